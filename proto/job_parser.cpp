#include "proto/job_parser.h"

#include <algorithm>
#include <limits>

#include "core/plan/features.h"
#include "proto/read_camera.h"
#include "proto/read_settings.h"
#include "proto/read_values.h"
#include "proto/scene_parser.h"

namespace tessera::proto {
namespace {

constexpr std::uint32_t kLargest32 = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kLongestName = 200;
constexpr std::size_t kLongestUrl = 2000;

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

/// Settles what depends on the image's size.
void fit_to_image(JobRequest& job, const Limits& limits, FieldErrors& errors) {
  Settings& settings = job.settings;
  const std::uint64_t pixels = std::uint64_t{settings.width} * settings.height;
  if (pixels > limits.max_pixels) {
    if (job.has_image) return;  // Said already.
    errors.add("/image", "Without this, the image has " + std::to_string(pixels) + " pixels; at most " +
                             std::to_string(limits.max_pixels) + " are allowed. Give a smaller width and height.");
    return;
  }
  if (pixels > limits.max_samples) {
    errors.add("/image", "The image has " + std::to_string(pixels) + " pixels; at most " +
                             std::to_string(limits.max_samples) +
                             " samples are allowed, and each pixel takes one. Make width or height smaller.");
    return;
  }
  if (job.samples_to_the_limit)
    settings.samples = static_cast<std::uint32_t>(std::min<std::uint64_t>(kLargest32, limits.max_samples / pixels));
  if (settings.samples > limits.max_samples / pixels) {
    errors.add(job.has_until ? "/settings/until/samples" : "/settings/samples",
               "At most " + std::to_string(limits.max_samples / pixels) +
                   " samples per pixel are allowed for an image of " + std::to_string(pixels) + " pixels.");
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

/// What only the scene tells of which integrator takes it, and of which settings that one reads.
void check_integrator(const Scene& scene, const Settings& settings, FieldErrors& errors) {
  const Features features = features_of(scene);
  const IntegratorKind chosen = chosen_integrator(settings.integrator, features);
  constexpr const char* kPlace = "/settings/integrator";
  if (chosen == IntegratorKind::whitted && !features.only_whitted) {
    errors.add(
        kPlace,
        "The scene has materials or lights that \"whitted\" doesn't know: what emits, has an alpha below 1, is "
        "rough, a metal, textured, unlit or absorbs light, spots, suns or environments. Take \"path\" or \"auto\".");
  }
  if ((chosen == IntegratorKind::path || chosen == IntegratorKind::direct) && !features.only_physical) {
    errors.add(kPlace,
               std::string("The scene has an ambient light or one without falloff, which have a meaning for "
                           "\"whitted\" alone") +
                   (features.only_whitted ? "; take that, or take the light out."
                                          : ", and something that \"whitted\" doesn't know; take the light out."));
  }
  if (settings.integrator == IntegratorKind::automatic) refuse_unread(chosen, settings, errors);
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
  if (job.settings.integrator != IntegratorKind::automatic)
    refuse_unread(job.settings.integrator, job.settings, document.errors());
  read(fields.optional("name"), job.name, kLongestName);
  read(fields.optional("priority"), job.priority, priority_names());
  read(fields.optional("webhook"), job.webhook, kLongestUrl);
  read_schema_name(fields.optional("$schema"));
  fields.refuse_unknown();
  if (const auto* inline_scene = std::get_if<ParsedScene>(&job.scene); inline_scene && inline_scene->scene) {
    take_size(*inline_scene->scene, job);
    check_integrator(*inline_scene->scene, job.settings, document.errors());
  }
  // The size that a scene has of its own isn't known yet where it is named by its hash: `fit_to_scene` looks then.
  if (job.has_image || std::holds_alternative<ParsedScene>(job.scene)) fit_to_image(job, limits, document.errors());
  if (!document.errors().empty()) return std::nullopt;
  return job;
}

std::optional<Problem> fit_to_scene(const Scene& scene, const Limits& limits, JobRequest& job) {
  take_size(scene, job);
  FieldErrors errors;
  check_integrator(scene, job.settings, errors);
  fit_to_image(job, limits, errors);
  if (errors.empty()) return std::nullopt;
  return std::move(errors).as_problem("job document");
}

}  // namespace tessera::proto
