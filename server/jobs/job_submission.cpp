#include "server/jobs/job_submission.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <variant>

#include "core/scene/frame_scene.h"
#include "server/config.h"
#include "server/handlers/image_choice.h"
#include "server/http/lane.h"
#include "server/jobs/job_runner.h"
#include "server/jobs/job_table.h"
#include "server/jobs/quotas.h"
#include "server/store/owners.h"
#include "server/store/scene_store.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

/// Of a scene that is looked through, for a camera say, in the quick lane.
constexpr std::size_t kQuickObjects = 10'000;

/// A problem of the scene that a job names by hash, as one of the job's document: places in the stored scene are
/// none in that.
Problem at_scene(const Problem& problem) {
  if (problem.code == ProblemCode::out_of_memory_budget || problem.code == ProblemCode::internal_error) return problem;
  const std::string& why = problem.errors.empty() ? problem.detail : problem.errors.front().detail;
  constexpr const char* kUnusable = "The scene that this job names can't be used.";
  return {ProblemCode::invalid_document, kUnusable, {{"/scene", kUnusable + (' ' + why)}}};
}

proto::Result<proto::ParsedScene> scene_of(Services& services, proto::JobRequest& job, const Principal& who,
                                           const std::stop_token& abandoned) {
  if (auto* parsed = std::get_if<proto::ParsedScene>(&job.scene)) return services.scenes.share(std::move(*parsed));
  const auto& hash = std::get<proto::ContentHash>(job.scene);
  if (!may_use_scene(services, who, hash)) return at_scene(no_such_scene(hash));
  auto found = services.scenes.find(hash, abandoned);
  if (!found) return at_scene(found.problem());
  return found;
}

/// An image that wouldn't fit if there were no other: waiting doesn't help.
std::optional<Problem> refuse_size(const Settings& settings, const Config& config) {
  const std::uint64_t bytes = image_bytes(settings) + passes_bytes(settings);
  if (bytes <= config.max_film_memory) return std::nullopt;
  return Problem{
      ProblemCode::invalid_document,
      "The image is too large for this server.",
      {{"/image", "Its " + std::to_string(bytes) + " bytes exceed the " + std::to_string(config.max_film_memory) +
                      " that the server has for images; ask for fewer pixels or AOVs."}}};
}

/// An image that would be rendered and then couldn't be fetched, or a plane of it.
std::optional<Problem> refuse_without_format(const Settings& settings) {
  Problem problem{ProblemCode::invalid_document, "No image format can hold this image.", {}};
  for (const PlaneEntry& plane : plane_table()) {
    const bool is_rendered =
        plane.plane == kColorPlane || (plane.plane.aov && settings.aovs.contains(*plane.plane.aov));
    if (!is_rendered || !able_formats(plane.plane, settings).empty()) continue;
    problem.errors.push_back({"/image", (plane.name.empty() ? "Its colour" : "Its " + std::string(plane.name)) +
                                            " fits into no format; make width or height smaller."});
  }
  if (problem.errors.empty()) return std::nullopt;
  return problem;
}

}  // namespace

bool may_use_scene(Services& services, const Principal& who, const proto::ContentHash& hash) {
  return who.may(proto::Scope::admin) || services.owners.has(who.owner, hash) ||
         services.jobs.has_job_of(who.owner, hash);
}

proto::Result<PreparedJob> prepare_job(Services& services, proto::JobRequest job, const Principal& who,
                                       const std::stop_token& abandoned) {
  auto scene = scene_of(services, job, who, abandoned);
  if (!scene) return scene.problem();
  if (FileBudget::is_limited() && scene->scene->objects.size() > kQuickObjects) throw TooHeavy{};
  if (auto problem = fit_to_scene(*scene->scene, services.config.documents, job)) return *std::move(problem);
  if (auto problem = refuse_size(job.settings, services.config)) return *std::move(problem);
  if (auto problem = refuse_without_format(job.settings)) return *std::move(problem);
  const std::optional<Camera>& wanted = job.camera ? job.camera : scene->scene->camera;
  const Camera camera =
      frame_scene(*scene->scene, job.settings.width, job.settings.height, wanted.value_or(kUnplacedCamera));
  return PreparedJob{std::move(job.name), *std::move(scene), camera, std::move(job.settings), who, {}};
}

proto::Result<std::string> start_job(Services& services, const PreparedJob& job, bool kept) {
  // Once it is admitted, whatever fails, fails the job.
  const JobOrder order{job.name,     job.scene.hash, job.scene.scene->warnings.size(),
                       job.settings, job.parsing,    job.who.owner};
  const proto::Key* key = job.who.key.get();
  const std::uint64_t samples = std::uint64_t{job.settings.width} * job.settings.height * job.settings.samples;
  if (key)
    if (auto problem = services.quotas.take_samples(*key, samples)) return *std::move(problem);
  const auto admitted =
      services.jobs.add(order, kept, key ? key->limits.unfinished_jobs : std::nullopt, job.scene.hold);
  if (!admitted) {
    if (key) services.quotas.give_samples_back(*key, samples);
    return admitted.problem();
  }
  services.runner.start(*admitted, order, job.scene.scene, job.camera);
  return admitted->id;
}

}  // namespace tessera::server
