// The JSON Schema of jobs lists what the tables list: it is a document for others, so it can't be made from them.

#include <fstream>
#include <map>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/accel/accel_table.h"
#include "core/bounds/slab_presets.h"
#include "proto/import/import.h"
#include "proto/names.h"
#include "proto/wire/priority.h"

namespace tessera::proto {
namespace {

using nlohmann::json;
using Names = std::set<std::string>;

json schema(const char* name) {
  std::ifstream file(std::string(TESSERA_SOURCE_DIR) + "/proto/schemas/" + name);
  return json::parse(file);
}

json settings() { return schema("job.schema.json")["properties"]["settings"]["properties"]; }
json accel() { return settings()["accel"]; }

Names names(std::span<const std::string_view> list) { return {list.begin(), list.end()}; }
template <typename T>
Names names(std::span<const Choice<T>> choices) {
  Names all;
  for (const Choice<T>& choice : choices) all.emplace(choice.name);
  return all;
}

TEST(JobSchema, ListsTheWords) {
  EXPECT_EQ(settings()["screen_bounds"]["enum"].get<Names>(), names(screen_bounds_names()));
  EXPECT_EQ(settings()["aovs"]["items"]["enum"].get<Names>(), names(aov_names()));
  EXPECT_EQ(settings()["integrator"]["enum"].get<Names>(), names(integrator_names()));
  EXPECT_EQ(settings()["sampler"]["enum"].get<Names>(), names(sampler_names()));
  EXPECT_EQ(settings()["filter"]["properties"]["type"]["enum"].get<Names>(), names(filter_names()));
  EXPECT_EQ(schema("job.schema.json")["properties"]["priority"]["enum"].get<Names>(), names(priority_names()));
  const json file = schema("scene.schema.json")["$defs"]["file"];
  EXPECT_EQ(file["properties"]["format"]["enum"].get<Names>(), names(file_format_names()));
}

TEST(JobSchema, ListsTheStructures) {
  Names kinds{"auto"};
  for (const AccelEntry& row : accel_table()) kinds.emplace(row.name);
  EXPECT_EQ(accel()["properties"]["kind"]["enum"].get<Names>(), kinds);
  EXPECT_EQ(accel()["properties"]["bound"]["enum"].get<Names>(), names(bound_names()));
  EXPECT_EQ(accel()["properties"]["space"]["enum"].get<Names>(), names(space_names()));
  const json normals = accel()["properties"]["normals"];
  EXPECT_EQ(normals["else"]["enum"], json(kSlabPresets));
  EXPECT_EQ(slab_preset(normals["default"].get<int>()), AccelOptions().normals);
  EXPECT_EQ(normals["then"]["maxItems"], kMostNormals);
}

TEST(JobSchema, ListsTheOptionsWithTheirRanges) {
  Names options{"kind"};
  for (const AccelOptionEntry& option : accel_option_table()) {
    options.emplace(option.name);
    if (!option.number) continue;
    const json listed = accel()["properties"][option.name];
    EXPECT_EQ(listed["minimum"], option.least) << option.name;
    EXPECT_EQ(listed["maximum"], option.most) << option.name;
    EXPECT_EQ(listed["default"], AccelOptions().*option.number) << option.name;
  }
  Names listed;
  const json properties = accel()["properties"];
  for (const auto& [name, _] : properties.items()) listed.insert(name);
  EXPECT_EQ(listed, options);
}

TEST(JobSchema, GivesEachKindTheOptionsOfItsRow) {
  std::map<std::string, Names> listed;
  const json rules = accel()["allOf"];
  for (const json& rule : rules) {
    if (!rule["then"].contains("propertyNames")) continue;
    const json kind = rule["if"]["properties"]["kind"];
    for (const json& name : kind.contains("enum") ? kind["enum"] : json{kind["const"]})
      EXPECT_TRUE(listed.emplace(name, rule["then"]["propertyNames"]["enum"].get<Names>()).second) << name;
  }
  std::map<std::string, Names> expected{{"auto", {"kind"}}};
  for (const AccelEntry& row : accel_table()) {
    Names& options = expected[std::string(row.name)] = names(row.options);
    options.insert("kind");
  }
  EXPECT_EQ(listed, expected);
}

TEST(JobSchema, SaysWhichBoundAnOptionGoesWith) {
  std::map<std::string, std::string> listed, expected;
  const json rules = accel()["allOf"];
  for (const json& rule : rules)
    if (rule["if"].contains("not"))
      for (const auto& [option, _] : rule["then"]["properties"].items())
        listed[option] = rule["if"]["not"]["properties"]["bound"]["const"];
  for (const AccelOptionEntry& option : accel_option_table())
    if (option.only_with)
      expected[std::string(option.name)] = bound_names()[static_cast<std::size_t>(*option.only_with)];
  EXPECT_EQ(listed, expected);
}

}  // namespace
}  // namespace tessera::proto
