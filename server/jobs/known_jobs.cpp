#include "server/jobs/known_jobs.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <string_view>
#include <utility>

#include "proto/parse.h"
#include "server/config.h"
#include "server/handlers/json_members.h"
#include "server/jobs/job_submission.h"
#include "server/store/blob_store.h"
#include "server/store/scene_store.h"

namespace tessera::server {
using proto::JobState;
using proto::Result;

namespace {

using Clock = JobTimes::Clock;

/// What is asked for may name files by hash, and what one owner may use another may not: each has what is known to
/// himself. No owner's name holds a space.
std::string key_for(const Principal& who, const std::string& key) { return who.owner + ' ' + key; }

Result<PreparedJob> prepare(Services& services, const Asset& asset, const JobDraft& draft, const Principal& who,
                            const std::stop_token& abandoned) {
  const proto::Limits& limits = services.config.documents;
  std::optional<proto::ParsedScene> scene;
  std::string document = draft.job;
  if (asset.kind != AssetKind::job_document) {
    auto parsed = draft.names_paths
                      ? proto::parse_scene(draft.scene, *asset.files, limits, abandoned)
                      : services.scenes.parse_once(key_for(who, draft.scene_key), draft.scene, *asset.files, abandoned);
    if (!parsed) return scene_problem(parsed.problem(), asset);
    scene = *std::move(parsed);
    document.back() = ',';
    document += "\"scene\":\"" + scene->hash + "\"}";
  }
  auto job = proto::parse_job(document, *asset.files, limits, abandoned);
  if (!job) return job_problem(job.problem(), asset);
  if (!job->webhook.empty())  // Who asks for the same thing shares a job.
    return proto::Problem{proto::ProblemCode::invalid_document,
                          "The document asks for more than an image.",
                          {{"/webhook", "Only jobs that are posted to /v1/jobs have webhooks."}}};
  if (scene) job->scene = *std::move(scene);
  auto prepared = prepare_job(services, *std::move(job), document, who, abandoned);
  if (!prepared) return job_problem(prepared.problem(), asset);
  return prepared;
}

/// Has the scene of a draft outlive its request.
std::optional<proto::Problem> keep_scene_of(Services& services, const Asset& asset, const JobDraft& draft,
                                            const proto::ContentHash& hash, const std::stop_token& abandoned) {
  if (services.scenes.is_kept(hash, abandoned)) return std::nullopt;
  const auto held = asset.files->keep_all(services.blobs, abandoned);
  if (!held) return held.problem();
  std::string_view document = draft.scene;
  const auto members = json_members(draft.job);
  if (asset.kind == AssetKind::job_document) {
    const auto scene = std::ranges::find(members, "scene", &JsonMember::name);
    if (scene == members.end() || !scene->value.starts_with('{'))
      return proto::Problem{proto::ProblemCode::invalid_document,
                            "The scene that this job names can't be used.",
                            {{"/scene", "There is no scene " + hash + "; POST it to /v1/scenes."}}};
    document = scene->value;
  }
  if (!draft.names_paths) {
    const auto kept = services.scenes.keep({nullptr, hash}, document, abandoned);
    return kept ? std::nullopt : std::optional(kept.problem());
  }
  const auto parsed = proto::parse_scene(document, *asset.files, services.config.documents, abandoned);
  if (!parsed) return scene_problem(parsed.problem(), asset);
  if (parsed->hash != hash)
    return proto::Problem{
        proto::ProblemCode::invalid_document, "Files that the scene names have changed; send it again.", {}};
  const auto kept = services.scenes.keep(*parsed, document, abandoned);
  return kept ? std::nullopt : std::optional(kept.problem());
}

}  // namespace

Result<HeldJob> find_or_start(Services& services, const std::string& key, bool is_kept_known, const PrepareJob& prepare,
                              const Principal& who, const std::function<bool(const JobView&)>& is_of_use,
                              const std::stop_token& abandoned) {
  const std::string owners_key = key_for(who, key);
  bool has_started = false;  // Then it is the job that is wanted, even where it has been forgotten since.
  const auto make = [&](const std::stop_token& unwanted) -> KnownJobs::Made {
    const auto begin = Clock::now();
    auto job = prepare(unwanted);
    if (!job) return {job.problem(), std::nullopt};
    job->parsing = Clock::now() - begin;
    const auto started = start_job(services, *job, false);
    if (!started) return {started.problem(), std::nullopt};
    has_started = true;
    const std::string& id = started->id;
    const auto bytes = is_kept_known ? std::optional<std::uint64_t>(id.size()) : std::nullopt;
    return {HeldJob{id, services.jobs.hold(id)}, bytes, HeldJob{id, nullptr}};
  };
  for (;;) {
    auto known = services.known_jobs.get(owners_key, make, abandoned);
    if (!known || known->hold || has_started) return known;
    known->hold = services.jobs.hold(known->id);
    const auto job = services.jobs.find(known->id);
    const bool has_ended_early = !job || job->state == JobState::failed || job->state == JobState::canceled;
    if (!has_ended_early && is_of_use(*job)) return known;
    services.known_jobs.drop(owners_key, [&](const Result<HeldJob>& kept) { return kept && kept->id == known->id; });
  }
}

Result<HeldJob> find_or_start(Services& services, const Asset& asset, const JobDraft& draft, const Principal& who,
                              const std::function<bool(const JobView&)>& is_of_use, const std::stop_token& abandoned) {
  const auto prepare_it = [&](const std::stop_token& unwanted) {
    return prepare(services, asset, draft, who, unwanted);
  };
  return find_or_start(services, draft.key, !draft.names_paths, prepare_it, who, is_of_use, abandoned);
}

Result<bool> keep_job(Services& services, const Asset& asset, const JobDraft& draft, const JobView& job,
                      const std::stop_token& abandoned) {
  if (auto problem = keep_scene_of(services, asset, draft, job.order->scene_hash, abandoned))
    return *std::move(problem);
  return services.jobs.keep(job.id);
}

}  // namespace tessera::server
