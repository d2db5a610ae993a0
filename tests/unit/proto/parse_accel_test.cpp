#include <algorithm>
#include <limits>
#include <optional>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/accel/accel_table.h"
#include "core/bounds/slab_presets.h"
#include "proto/parse.h"
#include "tests/unit/proto/test_files.h"

namespace tessera::proto {
namespace {

using nlohmann::json;
using Errors = std::vector<FieldError>;

struct Outcome {
  AccelOptions accel;
  Errors errors;
};

Outcome read(const json& accel) {
  const json job{{"scene", "sha256:" + std::string(64, '7')}, {"settings", {{"accel", accel}}}};
  const auto parsed = parse_job(job.dump(), NoFiles(), Limits());
  return parsed ? Outcome{parsed->settings.accel, {}} : Outcome{{}, parsed.problem().errors};
}

AccelOptions accepted(const json& accel) {
  const Outcome outcome = read(accel);
  for (const FieldError& error : outcome.errors) ADD_FAILURE() << accel << error.pointer << ": " << error.detail;
  return outcome.accel;
}

/// The one place that is refused, below the accel; more or none don't count.
std::string refused_at(const json& accel) {
  const Errors errors = read(accel).errors;
  const std::string prefix = "/settings/accel";
  if (errors.size() != 1 || !errors[0].pointer.starts_with(prefix)) return std::to_string(errors.size()) + " errors";
  return errors[0].pointer.substr(prefix.size());
}

json value_for(const AccelOptionEntry& option) {
  switch (option.type) {
    case AccelOptionType::number:
      return option.most;
    case AccelOptionType::bound:
      return "sphere";
    case AccelOptionType::space:
      return "object";
    case AccelOptionType::normals:
      return 13;
  }
  return {};
}

/// The kind with the option, and with the bound that the option needs.
json with_option(std::string_view kind, const AccelOptionEntry& option) {
  json accel{{"kind", kind}, {option.name, value_for(option)}};
  if (option.only_with) accel["bound"] = bound_names()[static_cast<std::size_t>(*option.only_with)];
  return accel;
}

TEST(ParseAccel, EveryKindIsReadByItsName) {
  EXPECT_EQ(accepted({{"kind", "auto"}}).kind, AccelKind::automatic);
  for (const AccelEntry& row : accel_table()) {
    AccelOptions expected;
    expected.kind = row.kind;
    EXPECT_EQ(accepted({{"kind", row.name}}), expected) << row.name;
  }
  EXPECT_EQ(refused_at({{"kind", "magic"}}), "/kind");
  EXPECT_EQ(refused_at(json::object()), "");
}

TEST(ParseAccel, AKindTakesTheOptionsOfItsRowAndNoOther) {
  for (const AccelEntry& row : accel_table())
    for (const AccelOptionEntry& option : accel_option_table()) {
      SCOPED_TRACE(std::string(row.name) + " with " + std::string(option.name));
      const Outcome outcome = read(with_option(row.name, option));
      const bool takes = std::ranges::find(row.options, option.name) != row.options.end();
      const auto at_option =
          std::ranges::find(outcome.errors, "/settings/accel/" + std::string(option.name), &FieldError::pointer);
      ASSERT_EQ(at_option == outcome.errors.end(), takes);
      if (takes) {
        EXPECT_TRUE(outcome.errors.empty());
        EXPECT_NE(describe(outcome.accel).find(' ' + std::string(option.name) + '='), std::string::npos);
        continue;
      }
      for (const AccelEntry& other : accel_table()) {
        const bool uses_it = std::ranges::find(other.options, option.name) != other.options.end();
        EXPECT_TRUE(!uses_it || at_option->detail.find(other.name) != std::string::npos) << at_option->detail;
      }
      for (const std::string_view own : row.options)
        EXPECT_NE(at_option->detail.find(own), std::string::npos) << at_option->detail;
    }
}

TEST(ParseAccel, AutoTakesNoOptions) {
  for (const AccelOptionEntry& option : accel_option_table()) {
    const Errors errors = read(with_option("auto", option)).errors;
    EXPECT_NE(std::ranges::find(errors, "/settings/accel/" + std::string(option.name), &FieldError::pointer),
              errors.end())
        << option.name;
  }
}

TEST(ParseAccel, NumbersKeepToTheirRange) {
  for (const AccelEntry& row : accel_table())
    for (const AccelOptionEntry& option : accel_option_table()) {
      if (!option.number || std::ranges::find(row.options, option.name) == row.options.end()) continue;
      SCOPED_TRACE(std::string(row.name) + " with " + std::string(option.name));
      json accel = with_option(row.name, option);
      for (const std::uint32_t good : {option.least, option.most}) {
        accel[option.name] = good;
        EXPECT_EQ(accepted(accel).*option.number, good);
      }
      const std::int64_t below = std::int64_t{option.least} - 1, above = std::int64_t{option.most} + 1;
      for (const json& bad : {json(below), json(above), json(option.least + 0.5), json("4"), json(nullptr)}) {
        accel[option.name] = bad;
        EXPECT_EQ(refused_at(accel), '/' + std::string(option.name)) << bad;
      }
    }
}

TEST(ParseAccel, BoundsAndSpacesByName) {
  for (std::size_t bound = 0; bound < bound_names().size(); ++bound)
    for (std::size_t space = 0; space < space_names().size(); ++space) {
      const AccelOptions accel =
          accepted({{"kind", "bvh"}, {"bound", bound_names()[bound]}, {"space", space_names()[space]}});
      EXPECT_EQ(accel.bound, static_cast<BoundKind>(bound));
      EXPECT_EQ(accel.space, static_cast<BoundSpace>(space));
    }
  EXPECT_EQ(refused_at({{"kind", "bvh"}, {"bound", "capsule"}}), "/bound");
  EXPECT_EQ(refused_at({{"kind", "bvh"}, {"space", 3}}), "/space");
}

TEST(ParseAccel, NormalsGoWithSlabsAndFacesWithHulls) {
  EXPECT_EQ(refused_at({{"kind", "bvh"}, {"normals", 3}}), "/normals");
  EXPECT_EQ(refused_at({{"kind", "bounds"}, {"bound", "hull"}, {"normals", 3}}), "/normals");
  EXPECT_EQ(refused_at({{"kind", "bvh"}, {"bound", "slabs"}, {"max_faces", 8}}), "/max_faces");
  const std::string detail = read({{"kind", "bvh"}, {"normals", 3}}).errors.at(0).detail;
  EXPECT_NE(detail.find("slabs"), std::string::npos) << detail;
  EXPECT_NE(detail.find("box"), std::string::npos) << detail;
  EXPECT_EQ(refused_at({{"kind", "bvh"}, {"bound", "slab"}, {"normals", 3}}), "/bound") << "one fault, told once";
}

TEST(ParseAccel, NormalsByPresetAndByTheUser) {
  const auto with = [](const json& normals) { return json{{"kind", "bvh"}, {"bound", "slabs"}, {"normals", normals}}; };
  for (const int preset : kSlabPresets) EXPECT_EQ(accepted(with(preset)).normals, slab_preset(preset));
  EXPECT_EQ(accepted({{"kind", "bvh"}, {"bound", "slabs"}}).normals, AccelOptions().normals);

  const float largest = std::numeric_limits<float>::max(), least = std::numeric_limits<float>::denorm_min();
  EXPECT_EQ(accepted(with({{1, -2, 0.5}, {0, largest, 0}, {0, 0, least}})).normals,
            (std::vector<Vec3>{{1, -2, 0.5F}, {0, largest, 0}, {0, 0, least}}));
  EXPECT_EQ(accepted(with(json(kMostNormals, json{0, 1, 0}))).normals.size(), kMostNormals);

  for (const json& bad :
       {json(5), json(3.5), json(-3), json("7"), json::array(), json(kMostNormals + 1, json{0, 1, 0})})
    EXPECT_EQ(refused_at(with(bad)), "/normals") << bad;
  EXPECT_EQ(refused_at(with({{1, 0, 0}, {0, -0.0, 0}})), "/normals/1");
  EXPECT_EQ(refused_at(with({{1, 0, 0}, {1e-60, 0, 0}})), "/normals/1") << "zero as the float that is kept";
  EXPECT_EQ(refused_at(with({{1, 0}})), "/normals/0");
  EXPECT_EQ(refused_at(with({{1, 0, 1e39}})), "/normals/0/2");
  EXPECT_EQ(refused_at(with({3, {1, 0, 0}})), "/normals/0");
}

TEST(ParseAccel, AnUnknownOptionIsAnUnknownField) {
  EXPECT_EQ(refused_at({{"kind", "grid"}, {"bins", 16}}), "/bins");
  EXPECT_NE(read({{"kind", "grid"}, {"bins", 16}}).errors.at(0).detail.find("Unknown field"), std::string::npos);
}

}  // namespace
}  // namespace tessera::proto
