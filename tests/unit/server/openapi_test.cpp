#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/accel/accel_table.h"
#include "proto/wire/job_status.h"
#include "proto/wire/problem.h"
#include "server/handlers/documents.h"
#include "server/handlers/image_choice.h"

namespace tessera::server {
namespace {

using Names = std::set<std::string>;

nlohmann::json document() { return nlohmann::json::parse(kOpenApiDocument); }

Names parameter_values(const std::string& name, const nlohmann::json& route) {
  for (const auto& parameter : route["parameters"])
    if (parameter["name"] == name) return parameter["schema"]["enum"].get<Names>();
  return {};
}

TEST(OpenApi, ListsTheProblemCodesThatThereAre) {
  Names names;
  for (const proto::ProblemEntry& entry : proto::problem_table()) names.emplace(entry.name);
  EXPECT_EQ(document()["components"]["schemas"]["Problem"]["properties"]["code"]["enum"].get<Names>(), names);
}

TEST(OpenApi, ListsTheStatesThatThereAre) {
  Names names;
  for (int i = 0; i <= static_cast<int>(proto::JobState::canceled); ++i)
    names.emplace(proto::name(static_cast<proto::JobState>(i)));
  EXPECT_EQ(document()["components"]["schemas"]["JobState"]["enum"].get<Names>(), names);
}

TEST(OpenApi, ListsTheOptionsOfStructures) {
  Names options, listed;
  for (const AccelOptionEntry& option : accel_option_table()) options.emplace(option.name);
  const nlohmann::json api = document();
  for (const auto& [name, _] : api["components"]["schemas"]["AccelOptions"]["properties"].items()) listed.insert(name);
  EXPECT_EQ(listed, options);
}

TEST(OpenApi, ListsTheImagesThatThereAre) {
  Names formats, planes, tone_maps;
  for (const FormatEntry& entry : format_table()) formats.emplace(entry.name);
  for (const PlaneEntry& entry : plane_table())
    if (!entry.name.empty()) planes.emplace(entry.name);
  for (const auto& choice : tone_map_names()) tone_maps.emplace(choice.name);
  const nlohmann::json paths = document()["paths"];
  for (const auto& route : {paths["/v1/jobs/{id}/image"]["get"], paths["/v1/render"]["post"]}) {
    EXPECT_EQ(parameter_values("format", route), formats);
    EXPECT_EQ(parameter_values("tone_map", route), tone_maps);
    EXPECT_EQ(parameter_values("aov", route), planes);
  }
}

}  // namespace
}  // namespace tessera::server
