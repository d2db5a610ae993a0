#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "proto/parse.h"
#include "server/webhooks/webhook_target.h"

namespace tessera::server {

/// Everything that can be set about the daemon. Sizes are bytes.
struct Config {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8080;              ///< 0: any free one.
  std::vector<std::string> host_names;    ///< That the server is called by, beside loopback's and its addresses.
  std::vector<std::string> cors_origins;  ///< Of web pages whose scripts may use it.
  bool require_keys = false;              ///< Everybody has to show a key, though none may have been made yet.
  bool insecure_no_keys = false;          ///< Start without keys where others than this machine reach the server.
  std::optional<std::filesystem::path> tls_certificate;  ///< PEM files: with both, connections speak TLS;
  std::optional<std::filesystem::path> tls_key;          ///< with neither, none does.
  unsigned threads = 0;  ///< That build and render; at least 1 once `parse_config` has run.
  std::filesystem::path data_dir;
  std::optional<std::filesystem::path> asset_root;  ///< Without one, scenes can't name files by path.
  std::string log_level = "info";
  std::string log_format = "text";  ///< Or "json".
  bool access_log = false;          ///< A line for each request.

  unsigned timeout = 30;  ///< Seconds for a request's header, and for each piece of a body.
  std::uint32_t max_connections = 1000;
  std::uint64_t max_body = 256ULL << 20;               ///< Of one JSON document.
  std::uint64_t max_blob = 8ULL << 30;                 ///< Of one uploaded file.
  std::uint64_t memory = 0;                            ///< For all that follows together:
  std::uint64_t max_bodies = 0;                        ///< of all JSON documents and small files held at once,
  std::uint32_t max_jobs = 1000;                       ///< Jobs that haven't ended.
  std::uint32_t max_ended_jobs = 10000;                ///< Jobs that have ended and are still known.
  std::uint64_t max_film_memory = 0;                   ///< of the images of all jobs; those of ended jobs give way,
  std::uint64_t image_cache = 0;                       ///< of encoded images kept for the next request,
  std::uint64_t work_memory = 0;                       ///< of scenes and structures that jobs work with, among them
  std::uint64_t scene_cache = 0;                       ///< parsed scenes kept for the next job,
  std::uint64_t structure_cache = 0;                   ///< and built structures.
  std::optional<std::filesystem::path> structure_dir;  ///< Where they are kept for the next start, if anywhere,
  std::uint64_t max_structure_dir = 16ULL << 30;       ///< and how much of them.
  std::uint64_t max_blob_bytes = 0;                    ///< Of all uploaded files on disk; 0 is no limit.
  std::uint64_t max_blob_age = 0;                      ///< Seconds since one was used; 0 is no limit.
  std::uint64_t max_scene_bytes = 0;                   ///< The same of stored scenes.
  std::uint64_t max_scene_age = 0;
  std::uint64_t max_image_bytes = 0;  ///< The same of finished images,
  std::uint64_t max_image_age = 0;    ///< but since the job has ended.
  std::uint64_t max_job_age = 0;      ///< Seconds since a job has ended; 0 is no limit.
  std::uint64_t max_job_seconds = 0;  ///< That may be worked on a job; 0 is no limit.
  proto::Limits documents;

  WebhookRules webhooks;
  std::optional<std::filesystem::path> webhook_secret;  ///< Where there are hosts for webhooks.

  std::uint64_t min_free_disk = 256ULL << 20;  ///< With less the server isn't ready.
  std::uint32_t max_parse_seconds = 120;       ///< For a file that a scene names, or an image in it.
  unsigned drain_seconds = 25;                 ///< How long jobs may go on after SIGTERM.

  bool drake = false;        ///< Serve POST /render as Drake's glTF render clients want it,
  std::string drake_prefix;  ///< under this path: empty, or "/" and segments.

  bool scrub = false;         ///< Check what lies on disk and leave.
  bool print_routes = false;  ///< Print the table of routes and leave.
};

/// Exit status of a program that was called in a way that makes no sense.
inline constexpr int kUsageError = 2;

/// Reads flags, then environment (TESSERA_PORT for --port, and so on), then the file that --config names; the
/// first that sets a value wins. An unknown flag or an unknown key of the file is an error. An exit status when
/// the program should leave at once: help was asked for (0), or something was wrong (`kUsageError`), and has been told
/// on `errors`, with where the value came from.
std::variant<Config, int> parse_config(int argc, const char* const* argv, std::ostream& out, std::ostream& errors);

/// The same with the arguments that the program was called with.
using ReadConfig = std::function<std::variant<Config, int>(std::ostream& out, std::ostream& errors)>;

}  // namespace tessera::server
