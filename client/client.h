#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "client/http.h"
#include "proto/wire/job_status.h"
#include "proto/wire/problem.h"
#include "proto/wire/sha256.h"

namespace tessera::client {

/// Which picture of a job.
struct ImageRequest {
  std::string format = "png";  ///< png, jpeg, exr, hdr.
  std::string aov{};           ///< Empty: colour.
  bool partial = false;        ///< Whatever is there already, of a job that still renders.
  // Empty: what the server takes.
  std::string exposure{};    ///< Stops.
  std::string tone_map{};    ///< none, khronos_pbr_neutral, aces.
  std::string precision{};   ///< half, float.
  std::string background{};  ///< Of what is transparent, or "transparent".
};

/// The calls of the HTTP API. Each throws `Failure` (refused, unreachable) when it can't do what it says.
/// Safe to call from any number of threads.
class Client {
 public:
  /// `key` is shown to the server with every call; empty for none.
  explicit Client(ServerAddress address, std::string key = {}) : address_(std::move(address)), key_(std::move(key)) {}

  /// Makes the file's bytes known to the server under their hash. Throws local_file, too.
  void upload(const std::filesystem::path& file, const proto::ContentHash& hash) const;

  /// Submits a job document.
  proto::JobStatus submit(const nlohmann::json& job) const;

  /// What the server left out of a scene, or didn't understand, and where.
  std::vector<proto::FieldError> warnings(const proto::ContentHash& scene) const;

  proto::JobStatus status(const std::string& id) const;

  /// Tells a job's status as it changes, until it has ended; returns the last. Where the server tells no events, or
  /// breaks off, it is asked, often at first, then every half second.
  proto::JobStatus watch(const std::string& id, const std::function<void(const proto::JobStatus&)>& tell) const;

  /// The encoded image.
  std::string fetch(const std::string& id, const ImageRequest& image) const;

  /// All jobs, the oldest first.
  std::vector<proto::JobStatus> list() const;

  /// The id of the job that is meant by an id, the beginning of one that no other job's has, or "@latest". Throws
  /// `usage` with the candidates when several begin so.
  std::string find_job(const std::string& written) const;

  void cancel(const std::string& id) const;
  void remove(const std::string& id) const;

  /// The plan and the statistics as the server tells them.
  nlohmann::json plan(const std::string& id) const;
  nlohmann::json stats(const std::string& id) const;

  /// The answer to a GET, whatever its status.
  HttpResponse ask(const std::string& target) const;

  /// What the server can do.
  nlohmann::json capabilities() const;

 private:
  /// The status at the end, if the server's events came that far.
  std::optional<proto::JobStatus> watch_events(const std::string& id,
                                               const std::function<void(const proto::JobStatus&)>& tell) const;

  /// The answer's body when its status is a success; the server's problem, thrown, otherwise.
  std::string call(HttpRequest request) const;

  ServerAddress address_;
  std::string key_;
};

}  // namespace tessera::client
