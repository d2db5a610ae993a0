#include "client/commands/scene_arguments.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/accel_argument.h"
#include "client/failure.h"
#include "client/scene_files.h"

namespace tessera::client {
namespace {

/// The server knows an uploaded file by its hash alone; the user knows it by its path.
std::vector<proto::FieldError> with_paths_for_hashes(std::vector<proto::FieldError> places,
                                                     const std::vector<LocalFile>& files) {
  for (auto& [pointer, detail] : places) {
    for (const LocalFile& file : files) {
      if (pointer.starts_with(file.hash)) pointer.replace(0, file.hash.size(), file.path.string());
    }
  }
  return places;
}

/// Tells the first few of a job's warnings, which may be as many as a mesh has broken triangles. The job runs whether
/// they can be had or not.
void tell_warnings(const Session& session, const proto::JobStatus& job, const std::vector<LocalFile>& files) try {
  constexpr std::size_t kMost = 10;
  const std::vector<proto::FieldError> warnings = with_paths_for_hashes(session.client().warnings(job.scene), files);
  for (std::size_t i = 0; i < std::min(kMost, warnings.size()); ++i) session.warn(warnings[i]);
  if (warnings.size() > kMost) session.note("there are " + std::to_string(warnings.size() - kMost) + " more warnings");
} catch (const Failure& failure) {
  session.note("there are " + std::to_string(job.warnings) +
               " warnings, which the server doesn't tell: " + failure.what());
}

}  // namespace

void SceneArguments::add_to(CLI::App& command) {
  command
      .add_option("SCENE", scene,
                  "A model (.glb, .gltf, .obj, .ply, .stl, .nff), a scene or job document (.json), or - for stdin")
      ->required();
  command.add_option_function<std::string>(
      "--size",
      [this](const std::string& text) {
        options.size = parse_size(text);
        if (!options.size) throw CLI::ValidationError("--size", "'" + text + "' isn't WIDTHxHEIGHT, like 640x480");
      },
      "Image size, like 640x480");
  // The library would wrap what is negative, cut off what is too large, and take 010 for 8.
  const CLI::Validator whole_number(
      [](std::string& text) {
        std::uint64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc() || end != text.data() + text.size())
          return text + " isn't a whole number from 0 to 18446744073709551615";
        text = std::to_string(value);
        return std::string();
      },
      "");
  // JSON has no infinity and no NaN, which the library takes.
  const CLI::Validator positive_number(
      [](const std::string& text) {
        const double value = std::strtod(text.c_str(), nullptr);
        return std::isfinite(value) && value > 0 ? std::string() : text + " isn't a number above 0";
      },
      "");
  command.add_option("--spp,--samples", options.samples, "Samples per pixel; the most of them, with --until-...")
      ->transform(whole_number);
  command
      .add_option("--until-error", options.error,
                  "Refine the image until its error is at most that: the root of its relative mean square error")
      ->check(positive_number);
  command.add_option("--until-seconds", options.seconds, "Refine the image for so many seconds")
      ->check(positive_number);
  command.add_option("--integrator", options.integrator,
                     "auto, whitted, direct, ambient_occlusion, path or none: how light goes from surface to surface");
  command.add_option("--sampler", options.sampler, "auto, grid, independent or sobol: where samples fall");
  command.add_flag("--transparent", options.transparent, "The background is transparent, in PNG and EXR");
  command.add_option("--max-depth", options.max_depth, "Rays in a chain, the camera's being the first")
      ->transform(whole_number);
  command.add_option("--seed", options.seed, "Seed of the samples")->transform(whole_number);
  command.add_option_function<std::string>(
      "--accel",
      [this](const std::string& text) {
        if (!parse_accel(text))
          throw CLI::ValidationError("--accel", "'" + text +
                                                    "' isn't KIND[,OPTION=VALUE...], like "
                                                    "bvh,bound=slabs,normals=1:0:0/0:1:1,space=object");
        options.accel = text;
      },
      "Acceleration structure: KIND[,OPTION=VALUE...], like bvh,bound=slabs,normals=1:0:0/0:1:1,space=object; "
      "'tessera capabilities' lists kinds and options");
  command.add_option("--screen-bounds", options.screen_bounds,
                     "Use of projected areas; 'tessera capabilities' lists the ways");
  command.add_option("--tile-size", options.tile_size, "auto, whole, or a number of pixels");
  command
      .add_option("--aov", options.aovs,
                  "Record a plane beside the colour; several with commas; 'tessera capabilities' lists them")
      ->delimiter(',')
      ->allow_extra_args(false);
  command.add_flag("--count-tests", options.count_tests, "Count what rays are tested against, for 'tessera stats'");
  command.add_flag("--allow-outside", allow_outside, "Upload files from outside the document's folder, too");
  command.add_option("--name", options.name, "The job's name in listings; the file's by default");
  command.add_option("--priority", options.priority, "low, normal or high, beside other jobs of yours");
  add_model_options(command);
}

void SceneArguments::add_model_options(CLI::App& command) {
  constexpr const char* kGroup = "Of a model's file";
  const auto add = [&](const char* name, auto& value, const char* words) {
    return command.add_option(name, value, words)->group(kGroup);
  };
  add("--camera", options.camera, "One of the file's cameras, by name or index, in place of one that sees it all");
  add("--azimuth", options.angles.azimuth, "From where that looks, in degrees: 0 is the front, 90 the side at +x; 30")
      ->check(CLI::Range(-360.0, 360.0));
  add("--elevation", options.angles.elevation, "Degrees that it stands above; 20")->check(CLI::Range(-90.0, 90.0));
  add("--fov", options.angles.fov, "Degrees from the image's top edge to its bottom edge; 30");
  add("--environment", options.environment,
      "What lights it: studio, an HDR or EXR image, or a radiance as one number or three (0.5, or 1,0.9,0.8)");
  add("--variant", options.variant, "One of the file's variants, by name");
  add("--smooth", options.smooth, "Smooth a mesh without normals over edges that are less sharp, in degrees")
      ->check(CLI::Range(0.0, 180.0));
  command
      .add_option_function<std::string>(
          "--up", [this](const std::string& up) { options.has_z_up = up == "z"; }, "The axis that is upright: y or z")
      ->check(CLI::IsMember({"y", "z"}))
      ->group(kGroup);
  command.add_flag("--no-ground", options.has_no_ground, "No shadow on the ground")->group(kGroup);
}

proto::JobStatus SceneArguments::submit(const Session& session) const {
  session.on_interrupt("");
  nlohmann::json job = job_document(scene, options);
  const NamedFiles files = name_files_by_content(
      job, {.folder = folder_of(scene), .named = named_files(scene, options), .allow_outside = allow_outside});
  for (const std::string& note : files.notes) session.note(note);
  const Client client = session.client();
  try {
    for (const LocalFile& file : files.to_upload) client.upload(file.path, file.hash);
    session.on_interrupt("the server may have taken the job; 'tessera list' shows it then");
    const proto::JobStatus status = client.submit(job);
    session.on_interrupt("job " + status.id + " goes on; 'tessera cancel " + status.id + "' ends it", status.id);
    if (status.warnings > 0) tell_warnings(session, status, files.to_upload);
    return status;
  } catch (const Failure& failure) {
    if (failure.kind() != Failure::Kind::refused) throw;
    for (const std::string& path : files.left_to_server)
      session.note("there is no file " + path + " here; it was left to the server to find");
    throw Failure(failure.kind(), failure.what(), with_paths_for_hashes(failure.errors(), files.to_upload),
                  failure.code());
  }
}

}  // namespace tessera::client
