#include "proto/job_parser.h"

#include <algorithm>
#include <limits>

#include "proto/names.h"
#include "proto/read_accel.h"
#include "proto/read_camera.h"
#include "proto/read_values.h"
#include "proto/scene_parser.h"

namespace tessera::proto {
namespace {

constexpr std::uint32_t kLargest32 = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t kLargest64 = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint32_t kLargestTile = 16384;
constexpr std::uint32_t kLargestDepth = 64;
constexpr std::size_t kLongestName = 200;

void read_image(JsonCursor value, Settings& settings, const Limits& limits) {
  JsonFields fields(value, "an image");
  bool good = read(fields.required("width"), settings.width, 1, kLargest32);
  good &= read(fields.required("height"), settings.height, 1, kLargest32);
  fields.refuse_unknown();
  const std::uint64_t pixels = std::uint64_t{settings.width} * settings.height;
  if (good && pixels > limits.max_pixels) {
    value.error("The image has " + std::to_string(pixels) + " pixels; at most " + std::to_string(limits.max_pixels) +
                " are allowed. Make width or height smaller.");
  }
}

void read_tile_size(JsonCursor value, Settings& settings, const Limits& limits) {
  if (value.is_number()) {
    if (!read(value, settings.tile_size, 1, kLargestTile)) return;
    const auto across = [&](std::uint64_t pixels) { return (pixels + settings.tile_size - 1) / settings.tile_size; };
    const std::uint64_t tiles = across(settings.width) * across(settings.height);
    if (tiles > limits.max_tiles)
      value.error("The image would have " + std::to_string(tiles) + " tiles; at most " +
                  std::to_string(limits.max_tiles) + " are allowed. Make the tiles larger.");
  } else if (value.kind() == JsonKind::string && value.string() == "whole") {
    settings.tile_size = std::max(settings.width, settings.height);
  } else if (value.kind() != JsonKind::string || value.string() != "auto") {
    value.expected("\"auto\", \"whole\" or an integer from 1 to " + std::to_string(kLargestTile));
  }
}

void read_aovs(JsonCursor value, Settings& settings) {
  if (value.kind() != JsonKind::array) {
    value.expected("an array of names");
    return;
  }
  for (const JsonCursor& element : value.elements()) {
    Aov aov{};
    const bool known = read(element, aov, aov_names());
    if (known && !settings.aovs.insert(aov).second) element.error("Named twice; keep one.");
  }
}

/// Precondition: the image's size is read.
void read_settings(JsonCursor value, Settings& settings, const Limits& limits) {
  JsonFields fields(value, "settings");
  const auto samples = fields.optional("samples");
  read(samples, settings.samples, 1, kLargest32);
  read(fields.optional("jitter"), settings.jitter);
  read(fields.optional("max_depth"), settings.max_depth, 1, kLargestDepth);
  read(fields.optional("seed"), settings.seed, 0, kLargest64);
  if (const auto accel = fields.optional("accel")) read_accel(*accel, settings.accel);
  read(fields.optional("screen_bounds"), settings.screen_bounds, screen_bounds_names());
  if (const auto tile_size = fields.optional("tile_size")) read_tile_size(*tile_size, settings, limits);
  if (const auto aovs = fields.optional("aovs")) read_aovs(*aovs, settings);
  read(fields.optional("count_tests"), settings.count_tests);
  fields.refuse_unknown();

  const std::uint64_t pixels = std::uint64_t{settings.width} * settings.height;
  if (samples && pixels <= limits.max_pixels && settings.samples > limits.max_samples / pixels) {
    samples->error("At most " + std::to_string(limits.max_samples / pixels) +
                   " samples per pixel are allowed for an image of " + std::to_string(pixels) + " pixels.");
  }
}

}  // namespace

std::optional<JobRequest> read_job(const JsonCursor& document, const FileSource& files, const Limits& limits) {
  JobRequest job;
  JsonFields fields(document, "a job");
  if (const auto scene = fields.required("scene")) {
    if (scene->kind() == JsonKind::object) {
      if (auto parsed = read_scene(*scene, files, limits)) job.scene = *std::move(parsed);
    } else if (scene->kind() == JsonKind::string && is_content_hash(scene->string())) {
      job.scene = ContentHash(scene->string());
    } else {
      scene->expected(
          "a scene document, or the content hash of a scene that was sent before (\"sha256:\" and 64 hexadecimal "
          "digits in lower case)");
    }
  }
  if (const auto camera = fields.optional("camera")) job.camera = read_camera(*camera);
  if (const auto image = fields.optional("image")) read_image(*image, job.settings, limits);
  if (const auto settings = fields.optional("settings")) read_settings(*settings, job.settings, limits);
  read(fields.optional("name"), job.name, kLongestName);
  read_schema_name(fields.optional("$schema"));
  fields.refuse_unknown();
  if (!document.errors().empty()) return std::nullopt;
  return job;
}

}  // namespace tessera::proto
