#include "client/accel_argument.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tessera::client {
namespace {

using nlohmann::json;

TEST(AccelArgument, IsAKindAndItsOptions) {
  EXPECT_EQ(parse_accel("auto"), json({{"kind", "auto"}}));
  EXPECT_EQ(parse_accel("bvh,bound=slabs,leaf_size=4,space=object"),
            json({{"kind", "bvh"}, {"bound", "slabs"}, {"leaf_size", 4}, {"space", "object"}}));
  EXPECT_EQ(parse_accel("bvh,normals=13"), json({{"kind", "bvh"}, {"normals", 13}}));
  EXPECT_EQ(parse_accel("new,thing=0.5"), json({{"kind", "new"}, {"thing", 0.5}})) << "the server knows, or refuses";
}

TEST(AccelArgument, VectorsHaveColonsAndSlashes) {
  EXPECT_EQ(parse_accel("bounds,bound=slabs,normals=1:0:0/0:-1.5:1e-3"),
            json({{"kind", "bounds"}, {"bound", "slabs"}, {"normals", {{1, 0, 0}, {0, -1.5, 1e-3}}}}));
  EXPECT_EQ((*parse_accel("bvh,normals=1:0:0"))["normals"], json::array({{1, 0, 0}}));
  EXPECT_EQ((*parse_accel("bvh,normals=1:0/2"))["normals"], json::array({{1, 0}, {2}}))
      << "the server says what's wrong";
}

TEST(AccelArgument, NothingForWhatIsNoArgument) {
  for (const char* text :
       {"", ",bound=box", "bvh,", "bvh,bound", "bvh,bound=", "bvh,bound=box,bound=box", "bvh,kind=kd",
        "bvh,normals=1:x:0", "bvh,normals=1::0", "bvh,normals=1:0:0/", "bvh,normals=1:inf:0"})
    EXPECT_FALSE(parse_accel(text)) << text;
}

TEST(AccelArgument, ComesBackAsItWas) {
  for (const char* text : {"brute", "bvh,bound=slabs,leaf_size=4,normals=1:0:0/0:-0.5:1,space=world"}) {
    json options = *parse_accel(text);
    options.erase("kind");
    EXPECT_EQ(accel_argument(std::string(text).substr(0, std::string(text).find(',')), options), text);
  }
}

}  // namespace
}  // namespace tessera::client
