#include "server/config.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <ostream>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/wire/given_memory.h"
#include "server/http/http_syntax.h"
#include "server/http/request.h"

namespace tessera::server {
namespace {

/// Environment variable of a flag: "--max-body" is TESSERA_MAX_BODY.
std::string variable_of(std::string_view flag) {
  std::string name = "TESSERA_";
  for (const char c : flag.substr(2))
    name += c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

std::filesystem::path default_data_dir() {
  if (const char* data = std::getenv("XDG_DATA_HOME"); data && *data) return std::filesystem::path(data) / "tessera";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::filesystem::path(home) / ".local" / "share" / "tessera";
  return "tessera-data";
}

/// CLI11 knows paths as strings only.
struct Paths {
  std::string data_dir = default_data_dir().string();
  std::string asset_root;
  std::string structure_dir;
  std::string tls_certificate, tls_key;
  std::string webhook_secret;
};

/// For what makes no sense when it is 0. Texts that are no numbers are refused elsewhere.
const CLI::Validator kAtLeast1(
    [](std::string& text) {
      const bool is_zero = !text.empty() && text.find_first_not_of('0') == std::string::npos;
      return is_zero ? std::string("has to be at least 1") : std::string();
    },
    "", "at least 1");

/// CLI11 takes -1 for the largest number of 64 bits.
const CLI::Validator kNotNegative(
    [](std::string& text) { return text.starts_with('-') ? std::string("can't be negative") : std::string(); }, "",
    "not negative");

const CLI::Validator kIsHostName(
    [](std::string& text) {
      const bool has_port = text.find(':', std::min(text.find(']'), text.size())) != std::string::npos ||
                            (!text.starts_with('[') && text.find(':') != std::string::npos);
      const bool is_name = !text.empty() && !has_port && is_host(text);
      return is_name ? std::string() : "'" + text + "' is no host name; write render.example.org, without a port";
    },
    "", "host name");

/// As browsers send it: RFC 6454, 6.2.
const CLI::Validator kIsOrigin(
    [](std::string& text) {
      const std::string_view scheme = text.starts_with("https://") ? "https://" : "http://";
      const bool is_origin = text.starts_with(scheme) && text.size() > scheme.size() &&
                             is_host(std::string_view(text).substr(scheme.size())) &&
                             std::ranges::none_of(text, [](char c) { return c >= 'A' && c <= 'Z'; });
      return is_origin ? std::string()
                       : "'" + text + "' is no origin; write https://example.org or http://localhost:3000";
    },
    "", "origin");

const CLI::Validator kIsWebhookHost(
    [](std::string& text) {
      return is_webhook_host(text) ? std::string()
                                   : "'" + text +
                                         "' is no host for webhooks; write hooks.example.org, hooks.example.org:8443 "
                                         "or *.example.org";
    },
    "", "host for webhooks");

/// "12h" becomes seconds.
const CLI::Validator kAge(
    [](std::string& text) {
      constexpr std::size_t kMostDigits = 9;
      constexpr std::pair<char, std::uint64_t> kUnits[] = {{'s', 1}, {'m', 60}, {'h', 3600}, {'d', 86400}};
      if (text == "0") return std::string();
      const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
      for (const auto& [unit, seconds] : kUnits) {
        if (digits < 1 || digits > kMostDigits || text.substr(digits) != std::string(1, unit)) continue;
        text = std::to_string(std::stoull(text.substr(0, digits)) * seconds);
        return std::string();
      }
      return std::string("write it as 90s, 30m, 12h or 30d, or 0");
    },
    "", "age");

void declare_flags(CLI::App& app, Config& config, Paths& paths) {
  const auto flag = [&app](const std::string& name, auto& value, const std::string& help) {
    return app.add_option(name, value, help)->envname(variable_of(name))->capture_default_str()->take_last();
  };
  const auto size = [&flag](const std::string& name, std::uint64_t& value, const std::string& help) {
    return flag(name, value, help + " (bytes, or with a unit: 64MiB)")
        ->transform(CLI::AsSizeValue(true))
        ->transform(kNotNegative);
  };
  const auto share = [&app](const std::string& name, std::uint64_t& value, const std::string& help) {
    return app.add_option(name, value, help + " (bytes, or with a unit: 64MiB; a share of --memory without it)")
        ->envname(variable_of(name))
        ->take_last()
        ->transform(CLI::AsSizeValue(true))
        ->transform(kNotNegative);
  };
  const auto list = [&app](const std::string& name, std::vector<std::string>& values, const std::string& help) {
    return app.add_option(name, values, help)->envname(variable_of(name))->delimiter(',')->allow_extra_args(false);
  };
  const auto age = [&flag](const std::string& name, std::uint64_t& value, const std::string& help) {
    return flag(name, value, help + " (12h, 30d; 0: however long)")->transform(kAge);
  };
  app.set_config("--config", "", "A file of `flag = value` lines")->envname("TESSERA_CONFIG");
  flag("--host", config.host, "Address to listen on");
  flag("--port", config.port, "Port to listen on; 0 takes any free one");
  list("--host-name", config.host_names,
       "Name that requests may call the server by, beside localhost and its addresses; once for each, or with commas")
      ->check(kIsHostName);
  list("--cors-origin", config.cors_origins,
       "Origin of web pages whose scripts may use the server, as https://example.org; none without it")
      ->check(kIsOrigin);
  app.add_flag("--require-keys", config.require_keys, "Answer nobody without a key, even while there are no keys")
      ->envname(variable_of("--require-keys"));
  app.add_flag("--insecure-no-keys", config.insecure_no_keys,
               "Start on an address beyond loopback though there are no keys: whoever reaches it may do everything")
      ->envname(variable_of("--insecure-no-keys"));
  flag("--tls-certificate", paths.tls_certificate,
       "PEM file with the server's certificate and, after it, those that vouch for it: connections speak TLS; SIGHUP "
       "reads it again");
  flag("--tls-key", paths.tls_key, "PEM file with the certificate's key, without a passphrase");
  list("--webhook-host", config.webhooks.hosts,
       "Host that jobs' webhooks may go to, as hooks.example.org, with a port where it isn't the usual one, or "
       "*.example.org; once for each, or with commas; none without it")
      ->check(kIsWebhookHost);
  flag("--webhook-secret", paths.webhook_secret,
       "File with what webhooks are signed with: whsec_ and 24 to 64 bytes in base64, a line for each while receivers "
       "change from one to another; SIGHUP reads it again");
  app.add_flag("--webhook-allow-private", config.webhooks.allow_private,
               "Send webhooks to loopback and private addresses, too, and to these without TLS")
      ->envname(variable_of("--webhook-allow-private"));
  flag("--threads", config.threads, "Threads that build and render; 0 takes one per core")
      ->check(CLI::Range(0U, 1024U));
  flag("--data-dir", paths.data_dir, "Where uploaded files and scenes are kept")->check([](const std::string& text) {
    return text.empty() ? "it names no folder" : std::string();
  });
  flag("--asset-root", paths.asset_root, "Folder whose files scenes may name by path; none without it");
  flag("--log-level", config.log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));
  flag("--log-format", config.log_format, "text, or json: an object a line")->check(CLI::IsMember({"text", "json"}));
  app.add_flag("--access-log", config.access_log, "Log a line for each request when it has been answered")
      ->envname(variable_of("--access-log"));
  flag("--timeout", config.timeout, "Seconds for a request's header and for each piece of a body")
      ->check(CLI::Range(1U, 3600U));
  size("--memory", config.memory,
       "What the process may take of memory; 0: three quarters of what its cgroup or the machine has");
  flag("--max-connections", config.max_connections, "Most connections at once; then the slowest make room")
      ->check(kAtLeast1);
  size("--max-body", config.max_body, "Largest JSON document")->check(kAtLeast1);
  size("--max-blob", config.max_blob, "Largest uploaded file")->check(kAtLeast1);
  share("--max-bodies", config.max_bodies, "All JSON documents and small files in flight together")->check(kAtLeast1);
  flag("--max-jobs", config.max_jobs, "Most jobs that haven't ended")->check(kAtLeast1);
  flag("--max-ended-jobs", config.max_ended_jobs, "Most jobs that have ended; the oldest are forgotten")
      ->check(kAtLeast1);
  share("--max-film-memory", config.max_film_memory, "Images of all jobs together; the oldest of ended jobs give way")
      ->check(kAtLeast1);
  share("--image-cache", config.image_cache, "Encoded images to keep");
  share("--scene-cache", config.scene_cache, "Parsed scenes to keep");
  share("--structure-cache", config.structure_cache, "Built structures and tables of lights to keep");
  flag("--structure-dir", paths.structure_dir,
       "Folder where hierarchies of meshes are kept for the next start, and for other daemons; none without it");
  size("--max-structure-dir", config.max_structure_dir, "Hierarchies in that folder together; the longest unused go")
      ->check(kAtLeast1);
  size("--min-free-disk", config.min_free_disk, "With less on the disk of --data-dir, /readyz says so");
  flag("--max-parse-seconds", config.max_parse_seconds,
       "A file that a scene names, or an image in it, may take so long to be read")
      ->check(CLI::Range(1U, 86400U));
  flag("--drain-seconds", config.drain_seconds, "How long jobs may go on after SIGTERM; a second one ends them at once")
      ->check(CLI::Range(0U, 86400U));
  size(
      "--max-blob-bytes", config.max_blob_bytes,
      "Uploaded files on disk together; the longest unused go, but for those that stored scenes need; 0: all that fit");
  age("--max-blob-age", config.max_blob_age, "How long uploaded files stay unused");
  size("--max-scene-bytes", config.max_scene_bytes,
       "Stored scenes together; the longest unused go, but for those that unfinished jobs need; 0: all that fit");
  age("--max-scene-age", config.max_scene_age, "How long stored scenes stay unused");
  size("--max-image-bytes", config.max_image_bytes,
       "Finished images on disk together, before they are encoded; the oldest go; 0: all that fit");
  age("--max-image-age", config.max_image_age, "How long finished images stay");
  age("--max-job-age", config.max_job_age, "How long jobs that have ended stay");
  age("--max-job-seconds", config.max_job_seconds, "How long a job may be worked on before it fails");
  flag("--max-pixels", config.documents.max_pixels, "Most pixels of an image")->check(kNotNegative)->check(kAtLeast1);
  flag("--max-samples", config.documents.max_samples, "Most samples of an image")
      ->check(kNotNegative)
      ->check(kAtLeast1);
  share("--max-scene-memory", config.documents.max_scene_bytes, "Largest parsed scene")->check(kAtLeast1);
  app.add_flag("--drake", config.drake, "Serve POST /render, which Drake's glTF render clients speak")
      ->envname(variable_of("--drake"));
  flag("--drake-prefix", config.drake_prefix, "Path under which that is, as /drake")
      ->check([](const std::string& text) {
        const bool is_path = text.empty() || (text.starts_with('/') && !text.ends_with('/') && parse_target(text));
        return is_path ? std::string() : std::string("write it as /drake or /robots/drake");
      });
  app.add_flag("--scrub", config.scrub,
               "Check the files in --data-dir and --structure-dir, set damaged ones aside, and leave: with 1 if there "
               "were any, 2 if it can't look")
      ->configurable(false);
  app.add_flag("--print-routes", config.print_routes, "Print the routes that are served and leave")
      ->configurable(false);
}

/// What is left of --memory for the program itself: its code, stacks, buffers of connections.
constexpr std::uint64_t kOfTheProgram = 48ULL << 20;
/// Requests that may parse a large scene at a time: as many as there are threads in the slow lane.
constexpr std::uint64_t kParsers = 2;

/// Divides --memory among all that isn't given a size of its own, and leaves the rest to what jobs work with.
void share_memory(const CLI::App& app, Config& config) {
  struct Share {
    const char* flag;
    std::uint64_t& value;
    std::uint64_t percent;
  };
  const Share shares[] = {{"--max-film-memory", config.max_film_memory, 30},
                          {"--structure-cache", config.structure_cache, 16},
                          {"--scene-cache", config.scene_cache, 8},
                          {"--image-cache", config.image_cache, 3},
                          {"--max-bodies", config.max_bodies, 5},
                          {"--max-scene-memory", config.documents.max_scene_bytes, 10}};
  if (config.memory == 0) config.memory = proto::given_memory().bytes / 4 * 3;
  for (const Share& share : shares)
    if (app.get_option(share.flag)->count() == 0) share.value = config.memory / 100 * share.percent;
  // So that a document that never fits is told so.
  if (app.get_option("--max-bodies")->count() == 0) config.max_body = std::min(config.max_body, config.max_bodies);
  std::uint64_t work = config.memory;
  for (const std::uint64_t others : {config.max_film_memory, config.image_cache, config.max_bodies, kOfTheProgram,
                                     kParsers * config.documents.max_scene_bytes})
    work -= std::min(others, work);
  // However the others were set, jobs can be worked on.
  config.work_memory = std::max(work, config.memory / 8);
}

/// Whether the command line has a flag.
bool is_given(const std::string& name, int argc, const char* const* argv) {
  return std::any_of(argv + 1, argv + argc, [&](std::string_view word) {
    return word.starts_with(name) && (word.size() == name.size() || word[name.size()] == '=');
  });
}

/// The command line with the environment's settings before it, as CLI11 wants it: last word first. The library
/// itself would let the file win over the environment.
std::vector<std::string> command_line(const CLI::App& app, int argc, const char* const* argv) {
  std::vector<std::string> words;
  for (const CLI::Option* option : app.get_options())
    if (const char* value = option->get_envname().empty() ? nullptr : std::getenv(option->get_envname().c_str());
        value && !is_given(option->get_name(), argc, argv))
      words.push_back(option->get_name() + "=" + value);
  words.insert(words.end(), argv + 1, argv + argc);
  std::ranges::reverse(words);
  return words;
}

/// Where the value that an error is about came from, if that isn't the command line.
std::string source_of(const CLI::App& app, const std::string& error, int argc, const char* const* argv) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_name(), &variable = option->get_envname();
    const std::size_t at = error.find(name);
    if (name.empty() || at == std::string::npos || std::isalnum(static_cast<unsigned char>(error[at + name.size()])) ||
        error[at + name.size()] == '-')
      continue;
    if (is_given(name, argc, argv)) return "";
    if (!variable.empty() && std::getenv(variable.c_str())) return " (from the environment: " + variable + ")";
    const CLI::Option* file = app.get_config_ptr();
    if (file->count() > 0) return " (from " + file->as<std::string>() + ")";
  }
  return "";
}

}  // namespace

std::variant<Config, int> parse_config(int argc, const char* const* argv, std::ostream& out, std::ostream& errors) {
  Config config;
  Paths paths;
  CLI::App app("tesserad: renders scenes that come in over HTTP", "tesserad");
  app.set_version_flag("--version", std::string(TESSERA_VERSION));
  app.allow_config_extras(CLI::config_extras_mode::error);
  declare_flags(app, config, paths);
  try {
    app.parse(command_line(app, argc, argv));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error, out, errors);  // Help, or the version.
    errors << error.what() << source_of(app, error.what(), argc, argv) << "\nRun with --help for more information.\n";
    return kUsageError;
  }
  share_memory(app, config);
  if (config.threads == 0) config.threads = std::max(1U, std::thread::hardware_concurrency());
  config.data_dir = paths.data_dir;
  if (!paths.asset_root.empty()) config.asset_root = paths.asset_root;
  if (!paths.structure_dir.empty()) config.structure_dir = paths.structure_dir;
  if (paths.tls_certificate.empty() != paths.tls_key.empty()) {
    errors << "--tls-certificate and --tls-key need one another\nRun with --help for more information.\n";
    return kUsageError;
  }
  if (config.webhooks.hosts.empty() != paths.webhook_secret.empty()) {
    errors << "--webhook-host and --webhook-secret need one another: webhooks are signed\n"
              "Run with --help for more information.\n";
    return kUsageError;
  }
  if (!paths.webhook_secret.empty()) config.webhook_secret = paths.webhook_secret;
  if (!paths.tls_key.empty()) {
    config.tls_certificate = paths.tls_certificate;
    config.tls_key = paths.tls_key;
  }
  return config;
}

}  // namespace tessera::server
