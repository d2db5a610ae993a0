#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/scene/settings.h"
#include "proto/wire/result.h"
#include "server/handlers/asset.h"
#include "server/handlers/image_choice.h"
#include "server/http/request.h"

namespace tessera::server {

/// A job document that is made of an asset and of query parameters, to go the same way as one that was sent.
struct JobDraft {
  std::string scene;             ///< The scene's document. Empty for a job document, which has one.
  proto::ContentHash scene_key;  ///< Equal documents that name the same files have the same; likewise:
  proto::ContentHash key;        ///< of the whole job.
  std::string job;               ///< The job document, without its scene where that stands above.
  Settings expected;             ///< Of the image, as far as it can be told before anything is parsed.
  ImageDefaults image;
  bool names_paths = false;  ///< Files by path can change, so that equal documents needn't mean equal images.
  bool is_timed = false;     ///< How good the image becomes depends on the machine.
};

/// The query parameters of POST /v1/render, those of its image included.
std::vector<std::string_view> render_query_names();

/// Refuses what isn't a value, and what the asset, or its document, leaves no place for.
proto::Result<JobDraft> draft_job(const Request& request, const Asset& asset);

/// A problem of a draft's scene in terms of what was sent: query parameters, and the file by its name.
proto::Problem scene_problem(proto::Problem problem, const Asset& asset);
/// A problem of the rest of its job, likewise.
proto::Problem job_problem(proto::Problem problem, const Asset& asset);

}  // namespace tessera::server
