#include "proto/read_settings.h"

#include <limits>
#include <string>

#include "core/plan/features.h"
#include "proto/names.h"
#include "proto/read_accel.h"
#include "proto/read_values.h"

namespace tessera::proto {
namespace {

constexpr std::uint32_t kLargest32 = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t kLargest64 = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint32_t kLargestTile = 16384;
constexpr std::uint32_t kLargestDepth = 64;
constexpr NumberRange kFilterWidth{1e-3F, 16, false, "a number of pixels from 0.001 to 16"};

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

void read_filter(JsonCursor value, Settings& settings) {
  JsonFields fields(value, "a filter");
  if (const auto type = fields.required("type")) read(type, settings.filter, filter_names());
  read(fields.optional("width"), settings.filter_width, kFilterWidth);
  fields.refuse_unknown();
}

void read_until(JsonCursor value, JobRequest& job) {
  JsonFields fields(value, "\"until\"");
  const auto samples = fields.optional("samples"), error = fields.optional("error"),
             seconds = fields.optional("seconds");
  read(samples, job.settings.samples, 1, kLargest32);
  job.has_until = true;
  job.samples_to_the_limit = !samples;
  float greatest_error = 0, most_seconds = 0;
  if (error && read(error, greatest_error, kPositive)) job.settings.error = greatest_error;
  if (seconds && read(seconds, most_seconds, kPositive)) job.settings.seconds = most_seconds;
  fields.refuse_unknown();
  if (value.kind() == JsonKind::object && !samples && !error && !seconds)
    value.error("Nothing here ends the job; give \"samples\", \"error\" or \"seconds\", or more than one of them.");
}

/// When the job ends.
void read_end(JsonFields& fields, JobRequest& job) {
  const auto samples = fields.optional("samples"), until = fields.optional("until");
  if (samples && until) samples->error("\"until\" says when the job ends; give \"samples\" there.");
  if (until) return read_until(*until, job);
  read(samples, job.settings.samples, 1, kLargest32);
}

void read_transport(JsonFields& fields, Settings& settings) {
  read(fields.optional("integrator"), settings.integrator, integrator_names());
  if (const auto depth = fields.optional("max_depth")) read(depth, settings.max_depth.emplace(), 1, kLargestDepth);
  const auto clamp = fields.optional("clamp");
  if (read(clamp, settings.clamp, kPositive) && clamp && settings.error)
    clamp->error(
        "No error can be claimed for an image from which light was cut off; leave \"clamp\" or the error out.");
  const auto reach = fields.optional("ambient_occlusion_distance");
  if (read(reach, settings.ambient_occlusion_reach, kPositive) && reach &&
      settings.integrator != IntegratorKind::ambient_occlusion)
    reach->error("This is for the integrator \"ambient_occlusion\", which has to be asked for.");
}

void read_sampling(JsonFields& fields, Settings& settings) {
  const auto filter = fields.optional("filter"), sampler = fields.optional("sampler");
  read(fields.optional("jitter"), settings.jitter);
  if (read(sampler, settings.sampler, sampler_names()) && settings.sampler == SamplerKind::grid &&
      measures_error(settings))
    sampler->error(
        "The grid's cells are filled one after the other, so all samples have to be taken; leave \"error\" and "
        "\"seconds\" out of \"until\", or take \"sobol\" or \"independent\".");
  read(fields.optional("seed"), settings.seed, 0, kLargest64);
  if (filter) read_filter(*filter, settings);
  if (filter && !settings.jitter)
    filter->error("Without \"jitter\" all samples fall on the pixel's centre, and a filter does nothing.");
}

}  // namespace

void read_settings(JsonCursor value, JobRequest& job) {
  Settings& settings = job.settings;
  JsonFields fields(value, "settings");
  read_end(fields, job);
  read_transport(fields, settings);
  read_sampling(fields, settings);
  const auto adaptive = fields.optional("adaptive");
  if (read(adaptive, settings.adaptive) && adaptive && !measures_error(settings))
    adaptive->error(
        "Samples go where there is error left only until an \"error\" or for \"seconds\"; give one of them in "
        "\"until\", or leave this out.");
  read(fields.optional("transparent"), settings.transparent);
  if (const auto accel = fields.optional("accel")) read_accel(*accel, settings.accel);
  read(fields.optional("screen_bounds"), settings.screen_bounds, screen_bounds_names());
  if (const auto tile_size = fields.optional("tile_size")) read_tile_size(*tile_size, job);
  if (const auto aovs = fields.optional("aovs")) read_aovs(*aovs, settings);
  read(fields.optional("count_tests"), settings.count_tests);
  fields.refuse_unknown();
  if (settings.transparent) settings.aovs.insert(Aov::alpha);
}

void refuse_unread(IntegratorKind integrator, const Settings& settings, FieldErrors& errors) {
  using enum IntegratorKind;
  const std::string name = in_quotes(name_of(integrator_names(), integrator));
  const auto refuse = [&](const char* setting, const std::string& why) {
    errors.add("/settings/" + std::string(setting), why + " The job's integrator is " + name + ".");
  };
  if (settings.sampler == SamplerKind::grid && integrator != whitted)
    refuse("sampler", "The sampler \"grid\" is for \"whitted\" alone; take \"sobol\" or \"independent\".");
  if (settings.clamp < kInfinity && integrator != path && integrator != direct)
    refuse("clamp", "Only \"path\" and \"direct\" have samples so bright that they are cut off; leave this out.");
  if (settings.max_depth && (integrator == ambient_occlusion || integrator == none))
    refuse("max_depth", "There is no light to follow; leave this out.");
  if (settings.max_depth.value_or(0) > kDirectDepth && integrator == direct)
    refuse("max_depth", "Direct light has " + std::to_string(kDirectDepth) + " rays in a chain at most.");
}

}  // namespace tessera::proto
