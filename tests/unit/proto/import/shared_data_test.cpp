#include "tests/support/shared_data_test.h"

#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "proto/import/import.h"
#include "tests/support/import_checks.h"
#include "tests/unit/proto/import/polygon_checks.h"

namespace tessera::proto {
namespace {

namespace fs = std::filesystem;

nlohmann::json read_json(const fs::path& path) { return nlohmann::json::parse(std::ifstream(path)); }

Result<Imported> import_beside(const fs::path& path, FileFormat format) {
  return import_file(path, format, path.filename().string(), [&](std::string_view name) -> std::optional<fs::path> {
    const fs::path companion = path.parent_path() / name;
    return fs::is_regular_file(companion) ? std::optional(companion) : std::nullopt;
  });
}

std::string first_error(const Problem& problem) {
  return problem.errors.empty() ? problem.detail : problem.errors[0].pointer + ": " + problem.errors[0].detail;
}

using SharedData = SharedDataTest;

TEST_F(SharedData, EveryFileIsImportedOrRefusedWithAPlace) {
  int imported = 0, refused = 0;
  for (const char* folder : {"importer-corpus", "meshes", "interior-kitchen", "spd-nff"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(data_ / folder)) {
      const std::string name = entry.path().filename().string();
      std::optional<FileFormat> format = format_of(name);
      if (name.starts_with("payload")) format = FileFormat::ply;
      if (!entry.is_regular_file() || !format) continue;
      SCOPED_TRACE(entry.path());
      if (const Result<Imported> result = import_beside(entry.path(), *format)) {
        EXPECT_EQ(fault_of_import(*result, entry.file_size()), "");
        ++imported;
      } else {
        EXPECT_EQ(result.problem().code, ProblemCode::invalid_document);
        EXPECT_EQ(fault_of_refusal(result.problem().errors, name), "");
        std::cout << "refused: " << first_error(result.problem()) << '\n';
        ++refused;
      }
    }
  }
  EXPECT_GT(imported, 140);
  EXPECT_GT(refused, 15);
}

TEST_F(SharedData, NffFilesHaveTheirCountedEntities) {
  const nlohmann::json expected = read_json(data_ / "spd-nff/entity_counts.json");
  for (const auto& [name, counts] : expected.items()) {
    SCOPED_TRACE(name);
    const Result<Imported> result = import_beside(data_ / "spd-nff" / name, FileFormat::nff);
    ASSERT_TRUE(result) << first_error(result.problem());
    std::size_t spheres = 0, cones = 0, triangles = 0;
    for (const ImportedPart& part : result->parts) {
      spheres += std::holds_alternative<Sphere>(part.shape);
      cones += std::holds_alternative<Cone>(part.shape) || std::holds_alternative<Cylinder>(part.shape);
      if (const auto* mesh = std::get_if<TriangleMesh>(&part.shape)) triangles += mesh->triangles.size();
    }
    EXPECT_EQ(spheres, counts["s"]);
    EXPECT_EQ(cones, counts["c"]);
    EXPECT_EQ(result->lights.size(), counts["l"]);
    EXPECT_EQ(result->materials.size(), counts["f"]);
    EXPECT_GE(triangles, counts["p"].get<std::size_t>() + counts["pp"].get<std::size_t>());
    EXPECT_TRUE(!result->cameras.empty() && result->background);
    for (const SceneWarning& warning : result->warnings) ADD_FAILURE() << warning.pointer << ": " << warning.detail;
  }
}

double signed_volume(const TriangleMesh& mesh) {
  double six_times = 0;
  for (const TriangleIndices& t : mesh.triangles) {
    six_times +=
        dot(to_double(mesh.positions[t[0]]), cross(to_double(mesh.positions[t[1]]), to_double(mesh.positions[t[2]])));
  }
  return six_times / 6;
}

double area(const TriangleMesh& mesh) {
  double twice = 0;
  for (const TriangleIndices& t : mesh.triangles) twice += length(area_vector(mesh.positions, t));
  return twice / 2;
}

TEST_F(SharedData, MeshesAreAsMeasured) {
  const nlohmann::json expected = read_json(data_ / "meshes/manifest.json");
  for (const auto& [name, facts] : expected.items()) {
    SCOPED_TRACE(name);
    const Result<Imported> result = import_beside(data_ / "meshes" / name, format_of(name).value());
    ASSERT_TRUE(result) << first_error(result.problem());
    ASSERT_EQ(result->parts.size(), 1U);
    const auto& mesh = std::get<TriangleMesh>(result->parts[0].shape);
    EXPECT_EQ(mesh.triangles.size(), facts["triangles_fan"]);
    // Those without a face aren't kept: a thousand of the bunny's.
    EXPECT_LE(mesh.positions.size(), facts["vertices"]);
    EXPECT_GT(mesh.positions.size(), facts["vertices"].get<double>() * 0.95);
    const Aabb box = bounds(result->parts[0].shape);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_FLOAT_EQ(box.lo[axis], facts["aabb_min"][axis].get<float>());
      EXPECT_FLOAT_EQ(box.hi[axis], facts["aabb_max"][axis].get<float>());
    }
    EXPECT_NEAR(area(mesh), facts["area"].get<double>(), 1e-6 * facts["area"].get<double>());
    EXPECT_NEAR(signed_volume(mesh), facts["signed_volume"].get<double>(), 1e-6 * facts["signed_volume"].get<double>());
  }
}

TEST_F(SharedData, TheGearsConcavePolygonsAreTiled) {
  std::ifstream file(data_ / "spd-nff/gears-s4.nff");
  std::size_t polygons = 0, most_corners = 0;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("p ")) continue;
    std::vector<Vec3> positions(std::stoul(line.substr(2)));
    for (Vec3& p : positions) file >> p.x >> p.y >> p.z;
    std::vector<TriangleIndices> triangles;
    const Indices corners = all_corners(positions.size());
    Steps steps;
    ASSERT_TRUE(triangulate(positions, corners, triangles, steps));
    expect_tiles(positions, corners, triangles, 1e-5);
    most_corners = std::max(most_corners, positions.size());
    ++polygons;
  }
  EXPECT_EQ(polygons, 9345U);
  EXPECT_EQ(most_corners, 144U);
}

}  // namespace
}  // namespace tessera::proto
