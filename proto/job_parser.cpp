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

void read_tile_size(JsonCursor value, JobRequest& job) {
  if (value.is_number()) {
    read(value, job.settings.tile_size, 1, kLargestTile);
  } else if (value.kind() == JsonKind::string && value.string() == "whole") {
    job.is_one_tile = true;
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

void read_settings(JsonCursor value, JobRequest& job) {
  Settings& settings = job.settings;
  JsonFields fields(value, "settings");
  read(fields.optional("samples"), settings.samples, 1, kLargest32);
  read(fields.optional("jitter"), settings.jitter);
  if (const auto depth = fields.optional("max_depth")) read(depth, settings.max_depth.emplace(), 1, kLargestDepth);
  read(fields.optional("seed"), settings.seed, 0, kLargest64);
  if (const auto accel = fields.optional("accel")) read_accel(*accel, settings.accel);
  read(fields.optional("screen_bounds"), settings.screen_bounds, screen_bounds_names());
  if (const auto tile_size = fields.optional("tile_size")) read_tile_size(*tile_size, job);
  if (const auto aovs = fields.optional("aovs")) read_aovs(*aovs, settings);
  read(fields.optional("count_tests"), settings.count_tests);
  fields.refuse_unknown();
}

/// Settles what depends on the image's size.
void fit_to_image(JobRequest& job, const Limits& limits, FieldErrors& errors) {
  Settings& settings = job.settings;
  const std::uint64_t pixels = std::uint64_t{settings.width} * settings.height;
  if (pixels > limits.max_pixels) return;  // Said already.
  if (settings.samples > limits.max_samples / pixels) {
    errors.add("/settings/samples", "At most " + std::to_string(limits.max_samples / pixels) +
                                        " samples per pixel are allowed for an image of " + std::to_string(pixels) +
                                        " pixels.");
  }
  if (job.is_one_tile) settings.tile_size = std::max(settings.width, settings.height);
  if (job.is_one_tile || settings.tile_size == kAdaptiveTiles) return;
  const auto across = [&](std::uint64_t side) { return (side + settings.tile_size - 1) / settings.tile_size; };
  const std::uint64_t tiles = across(settings.width) * across(settings.height);
  if (tiles > limits.max_tiles) {
    errors.add("/settings/tile_size", "The image would have " + std::to_string(tiles) + " tiles; at most " +
                                          std::to_string(limits.max_tiles) + " are allowed. Make the tiles larger.");
  }
}

void take_size(const Scene& scene, JobRequest& job) {
  if (job.has_image || !scene.image) return;
  job.settings.width = scene.image->width;
  job.settings.height = scene.image->height;
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
  const auto image = fields.optional("image");
  job.has_image = image.has_value();
  if (image) read_image(*image, job.settings, limits);
  if (const auto settings = fields.optional("settings")) read_settings(*settings, job);
  read(fields.optional("name"), job.name, kLongestName);
  read_schema_name(fields.optional("$schema"));
  fields.refuse_unknown();
  if (const auto* inline_scene = std::get_if<ParsedScene>(&job.scene); inline_scene && inline_scene->scene)
    take_size(*inline_scene->scene, job);
  // The size that a scene has of its own isn't known yet where it is named by its hash: `take_image` looks then.
  if (job.has_image || std::holds_alternative<ParsedScene>(job.scene)) fit_to_image(job, limits, document.errors());
  if (!document.errors().empty()) return std::nullopt;
  return job;
}

std::optional<Problem> take_image(const Scene& scene, const Limits& limits, JobRequest& job) {
  take_size(scene, job);
  FieldErrors errors;
  fit_to_image(job, limits, errors);
  if (errors.empty()) return std::nullopt;
  return std::move(errors).as_problem("job document");
}

}  // namespace tessera::proto
