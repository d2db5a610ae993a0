#include "server/jobs/job_submission.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <utility>
#include <variant>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "core/scene/frame_scene.h"
#include "proto/wire/abandoned.h"
#include "server/config.h"
#include "server/handlers/image_choice.h"
#include "server/handlers/json_members.h"
#include "server/http/lane.h"
#include "server/jobs/job_event.h"
#include "server/jobs/job_runner.h"
#include "server/jobs/job_starter.h"
#include "server/jobs/job_table.h"
#include "server/jobs/quotas.h"
#include "server/store/image_store.h"
#include "server/store/journal.h"
#include "server/store/owners.h"
#include "server/store/scene_store.h"
#include "server/webhooks/webhook_target.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

/// Of a scene that is looked through, for a camera say, in the quick lane.
constexpr std::size_t kQuickObjects = 10'000;

/// A problem of the scene that a job names by hash, as one of the job's document: places in the stored scene are
/// none in that.
Problem at_scene(const Problem& problem) {
  if (problem.code == ProblemCode::out_of_memory_budget || problem.code == ProblemCode::internal_error ||
      problem.code == ProblemCode::reader_unavailable)
    return problem;
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

/// What wouldn't fit if there were no other job: waiting doesn't help.
Problem too_large_for(const Ledger& ledger, const Ledger::Need& need) {
  return {ProblemCode::job_too_large,
          "The scene is too large for this server.",
          {{"/scene", "Its geometry and the structure over it may take " + std::to_string(need.bytes()) + " of the " +
                          std::to_string(ledger.limit()) +
                          " bytes that the server has for that; send less, or have it given more (--memory)."}}};
}

/// The same of the image.
std::optional<Problem> refuse_size(const Settings& settings, const Config& config) {
  const std::uint64_t bytes = image_bytes(settings) + passes_bytes(settings);
  if (bytes <= config.max_film_memory) return std::nullopt;
  return Problem{
      ProblemCode::job_too_large,
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

/// What the job's document asks for, with all that it leaves to the scene and to the server's limits said.
std::string order_document(std::string_view document, const proto::JobRequest& job, const proto::ContentHash& scene) {
  const Settings& settings = job.settings;
  std::string order = R"({"scene":")" + scene + R"(","image":{"width":)" + std::to_string(settings.width) +
                      R"(,"height":)" + std::to_string(settings.height) + '}';
  for (const JsonMember& member : json_members(document)) {
    constexpr std::string_view kTaken[] = {"camera", "settings", "name", "priority", "webhook"};
    if (std::ranges::find(kTaken, member.name) == std::end(kTaken)) continue;
    std::string value(member.value);
    if (member.name == "settings" && job.samples_to_the_limit) {
      auto all = nlohmann::json::parse(value);
      all["until"]["samples"] = settings.samples;
      value = all.dump();
    }
    order += ",\"" + member.name + "\":" + value;
  }
  return order + '}';
}

}  // namespace

proto::Result<PreparedJob> prepare_again(Services& services, const JobOrder& order, const std::stop_token& stop) {
  const auto job = read_order_document(order.document);
  if (!job) return job.problem();
  const auto scene = services.scenes.find(order.scene_hash, stop);
  if (!scene) return at_scene(scene.problem());
  const std::optional<Camera>& camera = job->camera ? job->camera : scene->scene->camera;
  const Camera placed =
      frame_scene(*scene->scene, order.settings.width, order.settings.height, camera.value_or(kUnplacedCamera));
  return PreparedJob{order.name, *scene, placed, order.settings, {}, order.parsing, order.document};
}

bool may_use_scene(Services& services, const Principal& who, const proto::ContentHash& hash) {
  return who.may(proto::Scope::admin) || services.owners.has(who.owner, hash) ||
         services.jobs.has_job_of(who.owner, hash);
}

proto::Result<PreparedJob> prepare_job(Services& services, proto::JobRequest job, std::string_view document,
                                       const Principal& who, const std::stop_token& abandoned) {
  if (!job.webhook.empty())
    if (const auto target = read_webhook(services.config.webhooks, job.webhook); !target) return target.problem();
  auto scene = scene_of(services, job, who, abandoned);
  if (!scene) return scene.problem();
  if (FileBudget::is_limited() && scene->scene->objects.size() > kQuickObjects) throw TooHeavy{};
  if (auto problem = fit_to_scene(*scene->scene, services.config.documents, job)) return *std::move(problem);
  if (auto problem = refuse_size(job.settings, services.config)) return *std::move(problem);
  if (auto problem = refuse_without_format(job.settings)) return *std::move(problem);
  const std::optional<Camera>& wanted = job.camera ? job.camera : scene->scene->camera;
  const Camera camera =
      frame_scene(*scene->scene, job.settings.width, job.settings.height, wanted.value_or(kUnplacedCamera));
  std::string order = document.empty() ? "" : order_document(document, job, scene->hash);
  return PreparedJob{
      std::move(job.name), *std::move(scene),     camera, std::move(job.settings), who, {}, std::move(order), {},
      job.priority,        std::move(job.webhook)};
}

std::optional<Problem> keep_scene(Services& services, const PreparedJob& job, std::string_view document,
                                  const std::stop_token& abandoned) {
  if (services.scenes.is_kept(job.scene.hash, abandoned)) return std::nullopt;
  const auto members = json_members(document);
  const auto scene = std::ranges::find(members, "scene", &JsonMember::name);
  if (scene != members.end() && scene->value.starts_with('{')) {
    const auto kept = services.scenes.keep(job.scene, scene->value, abandoned);
    return kept ? std::nullopt : std::optional(at_scene(kept.problem()));
  }
  // It is in memory, for a request that has sent it.
  return at_scene(no_such_scene(job.scene.hash));
}

proto::Result<JobTable::Admitted> start_job(Services& services, const PreparedJob& job, bool kept) {
  const Ledger::Need need = memory_need(job);
  if (need.bytes() > services.ledger.limit()) return too_large_for(services.ledger, need);
  // While others wait, one more does: it doesn't go before them.
  auto memory = kept && services.starter.has_waiting() ? nullptr : services.ledger.book(need);
  if (!memory && !kept)
    return Problem{ProblemCode::out_of_memory_budget,
                   "The jobs at work leave no memory for this one; send it again when some have ended.",
                   {}};
  // Once it is admitted, whatever fails, fails the job.
  const JobOrder order{job.name,     job.scene.hash, job.scene.scene->warnings.size(),
                       job.settings, job.parsing,    job.who.owner,
                       job.document, job.retry,      need,
                       job.priority, job.webhook};
  const proto::Key* key = job.who.key.get();
  const std::uint64_t samples = std::uint64_t{job.settings.width} * job.settings.height * job.settings.samples;
  if (key)
    if (auto problem = services.quotas.take_samples(*key, samples)) return *std::move(problem);
  auto admitted = services.jobs.add(order, kept, key ? key->limits.unfinished_jobs : std::nullopt, job.scene.hold);
  if (!admitted) {
    if (key) services.quotas.give_samples_back(*key, samples);
    return admitted.problem();
  }
  if (memory) {
    admitted->memory = std::move(memory);
    services.runner.start(*admitted, order, job.scene.scene, job.camera);
  } else {
    services.starter.add(admitted->id);
  }
  return admitted;
}

std::vector<std::string> restore_jobs(const Journal& journal, const ImageStore& films, SceneStore& scenes,
                                      JobTable& jobs) {
  constexpr std::size_t kAtOnce = 1000;
  std::uint64_t last = 0;
  for (auto entries = journal.since(last, kAtOnce); !entries.empty(); entries = journal.since(last, kAtOnce)) {
    for (const JournalEntry& entry : entries) {
      try {
        jobs.restore(entry.job, read_event(entry), entry.seq);
      } catch (const std::exception& error) {
        spdlog::error("job {}: event {} of the journal is left out: {}", entry.job, entry.seq, error.what());
      }
    }
    last = entries.back().seq;
  }
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  const std::set<std::string> images = films.jobs();
  for (const JobView& job : jobs.list("", kAll, proto::JobState::completed)) {
    if (job.image != proto::ImageState::complete || images.contains(job.id)) continue;
    spdlog::error("job {}: its image isn't there any more", job.id);
    jobs.render_again(job.id, nullptr);
  }
  return jobs.queue_again([&](const JobOrder& order) { return scenes.hold(order.scene_hash); });
}

proto::Result<std::shared_ptr<const Film>> find_film(Services& services, const std::string& id) {
  auto film = services.jobs.film(id);
  if (!film || *film) return film;
  if (FileBudget::is_limited()) throw TooHeavy{};
  if (auto loaded = services.films.load(id)) {
    const Pixels& pixels = loaded->pixels();
    services.jobs.lend(loaded, pixels.color.size() * Pixels::bytes_per_pixel(pixels.aovs()));
    return loaded;
  }
  const auto job = services.jobs.find(id);
  if (!job) return job.problem();
  if (!services.jobs.render_again(id, services.scenes.hold(job->order->scene_hash))) return services.jobs.film(id);
  services.starter.add(id);
  return Problem{ProblemCode::image_not_ready, "The image turned out to be damaged on disk; it is rendered again.", {}};
}

}  // namespace tessera::server
