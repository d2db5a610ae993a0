#include "server/handlers/accel_json.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/accel/accel_table.h"
#include "proto/parse.h"
#include "tests/support/no_files.h"

namespace tessera::server {
namespace {

using nlohmann::json;

json row_of(const std::string& kind) {
  for (const json& row : accel_capabilities_json())
    if (row["kind"] == kind) return row;
  return nullptr;
}

json option_of(const std::string& kind, const std::string& option) {
  const json options = row_of(kind)["options"];
  for (const json& row : options)
    if (row["name"] == option) return row;
  return nullptr;
}

TEST(AccelJson, ListsEveryStructureWithItsOptions) {
  const json list = accel_capabilities_json();
  ASSERT_EQ(list.size(), accel_table().size() + 1);
  EXPECT_EQ(list[0]["kind"], "auto");
  EXPECT_EQ(list[0]["options"], json::array());
  for (const AccelEntry& entry : accel_table()) {
    const json row = row_of(std::string(entry.name));
    EXPECT_EQ(row["summary"], entry.summary);
    ASSERT_EQ(row["options"].size(), entry.options.size()) << entry.name;
    for (const std::string_view option : entry.options)
      EXPECT_FALSE(option_of(std::string(entry.name), std::string(option)).is_null()) << option;
  }
}

TEST(AccelJson, SaysWhatAnOptionTakes) {
  const json leaf_size = option_of("bvh", "leaf_size"), bound = option_of("bvh", "bound");
  const json normals = option_of("bvh", "normals");
  EXPECT_EQ(leaf_size["type"], "integer");
  EXPECT_EQ(leaf_size["least"], 1);
  EXPECT_EQ(leaf_size["most"], 255);
  EXPECT_EQ(leaf_size["default"], AccelOptions().leaf_size);
  EXPECT_FALSE(leaf_size.contains("only_with"));
  EXPECT_EQ(bound["type"], "word");
  EXPECT_EQ(bound["values"], json(bound_names()));
  EXPECT_EQ(bound["default"], "box");
  EXPECT_EQ(normals["type"], "normals");
  EXPECT_EQ(normals["presets"], json({3, 7, 9, 13}));
  EXPECT_EQ(normals["most"], 32);
  EXPECT_EQ(normals["default"].size(), AccelOptions().normals.size());
  EXPECT_EQ(normals["only_with"], json({{"bound", "slabs"}}));
}

TEST(AccelJson, TellsTheOptionsInUseAndNoOther) {
  AccelOptions options;
  options.kind = AccelKind::bvh;
  options.leaf_size = 3;
  EXPECT_EQ(accel_options_json(options), json({{"bound", "box"}, {"space", "world"}, {"leaf_size", 3}}));
  options.bound = BoundKind::slabs;
  options.space = BoundSpace::object;
  options.normals = {{1, 0, 0.5F}};
  EXPECT_EQ(
      accel_options_json(options),
      json({{"bound", "slabs"}, {"space", "object"}, {"leaf_size", 3}, {"normals", json::array({{1.0, 0.0, 0.5}})}}));
  options.kind = AccelKind::brute;
  EXPECT_EQ(accel_options_json(options), json::object());
  options.kind = AccelKind::automatic;
  EXPECT_EQ(accel_options_json(options), json::object());
}

TEST(AccelJson, WhatIsToldOfAStructureCanBeAskedFor) {
  for (const AccelEntry& entry : accel_table())
    for (const BoundKind bound : {BoundKind::box, BoundKind::sphere, BoundKind::slabs, BoundKind::hull}) {
      AccelOptions options;
      options.kind = entry.kind;
      options.bound = bound;
      options.normals = {{0.1F, -3e38F, 1e-40F}, {1, 2, 3}};
      json accel = accel_options_json(options);
      accel["kind"] = entry.name;
      const json job{{"scene", {{"objects", json::array()}}}, {"settings", {{"accel", accel}}}};
      const auto parsed = proto::parse_job(job.dump(), proto::NoFiles(), proto::Limits());
      ASSERT_TRUE(parsed) << accel;
      EXPECT_EQ(describe(parsed->settings.accel), describe(options));
    }
}

}  // namespace
}  // namespace tessera::server
