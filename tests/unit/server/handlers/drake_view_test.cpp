#include "server/handlers/drake_view.h"

#include <string>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

/// Turned by 90° about y, so that it looks along -x, and moved.
const std::string kMatrix = "[0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 3, 4, 5, 1]";

std::string file_with(const std::string& nodes) {
  return R"({"asset": {"version": "2.0"}, "nodes": [)" + nodes + R"(], "buffers": []})";
}
std::string camera_with(const std::string& matrix) {
  return R"({"camera": 0, "matrix": )" + matrix + R"(, "name": "Camera Node"})";
}

TEST(DrakeView, IsWhereTheCamerasNodeStands) {
  const auto found = find_drake_view(file_with(R"({"mesh": 0}, )" + camera_with(kMatrix) + R"(, {"children": [0]})"));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->view.from, (Vec3{3, 4, 5}));
  EXPECT_LT(found->view.at.x, 3);
  EXPECT_EQ(found->view.at.y, 4);
  EXPECT_EQ(found->view.at.z, 5);
  EXPECT_EQ(found->view.up, (Vec3{0, 1, 0}));
}

TEST(DrakeView, RestIsAllButTheMatrix) {
  const std::string mesh = R"({"mesh": 0, "matrix": [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}, )";
  const auto one = find_drake_view(file_with(mesh + camera_with(kMatrix)));
  const auto other = find_drake_view(file_with(mesh + camera_with("[1,0,0,0,0,1,0,0,0,0,1,0,7,0,0,1]")));
  ASSERT_TRUE(one && other);
  EXPECT_EQ(one->rest, other->rest);
  EXPECT_EQ(other->view.from, (Vec3{7, 0, 0}));
  const auto moved = find_drake_view(
      file_with(R"({"mesh": 0, "matrix": [1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1]}, )" + camera_with(kMatrix)));
  ASSERT_TRUE(moved);
  EXPECT_NE(moved->rest, one->rest);
}

TEST(DrakeView, IsntCutOutOfWhatMayMeanSomethingElse) {
  const std::string camera = camera_with(kMatrix);
  for (const std::string& nodes :
       {std::string(), std::string(R"({"mesh": 0})"), camera + ", " + camera, R"({"children": [1]}, )" + camera,
        std::string(R"({"camera": 0})"), R"({"camera": 0, "mesh": 0, "matrix": )" + kMatrix + "}",
        R"({"camera": 0, "children": [1], "matrix": )" + kMatrix + R"(}, {"mesh": 0})",
        R"({"camera": 0, "matrix": )" + kMatrix + R"(, "matrix": )" + kMatrix + "}",
        R"({"camera": 0, "translation": [1, 0, 0], "matrix": )" + kMatrix + "}",
        R"({"c\u0061mera": 0, "mesh": 1}, )" + camera, camera_with("[1, 2, 3]"), camera_with("{}"), camera_with("[1"),
        camera_with("[2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]"), camera_with("[1,1,0,0,0,1,0,0,0,0,1,0,0,0,0,1]"),
        camera_with("[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,2]"), camera_with("[1,0,0,0,0,1,0,0,0,0,1,0,1e300,0,0,1]")})
    EXPECT_FALSE(find_drake_view(file_with(nodes))) << nodes;
  for (const char* file : {"", "{", "[]", R"({"nodes": {}})", R"({"nodes": [{"camera")", "glTF\x02"})
    EXPECT_FALSE(find_drake_view(file)) << file;
}

}  // namespace
}  // namespace tessera::server
