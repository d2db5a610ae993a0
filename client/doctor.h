#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/client.h"

namespace tessera::client {

/// What one look at a server, or at the machine that it runs on, came to.
struct Finding {
  enum class Verdict { ok, warn, fail };
  Verdict verdict;
  std::string check;
  std::string detail;
  std::string advice{};  ///< What to do; empty where all is well.
};

/// What `GET /metrics` says, by name and labels as they stand there: `tessera_jobs{state="queued"}`. Lines that aren't
/// samples are left out.
std::map<std::string, double> read_metrics(std::string_view text);

/// Seconds since 1970 of a Date header (RFC 9110, 5.6.7, the first of its forms); nothing for anything else.
std::optional<double> read_http_date(const std::string& text);

/// Asks the server for all that it says of itself and has it render a small image, which is deleted again. Never
/// throws a `Failure`: that is a finding. `version` is this program's own.
std::vector<Finding> examine_server(const Client& client, std::string_view version);

/// Looks at the data folder of a server that runs on this machine, at its disk, and at what its process may have.
/// `metrics` are the server's, or empty.
std::vector<Finding> examine_machine(const std::filesystem::path& data_dir,
                                     const std::map<std::string, double>& metrics);

/// Looks at the PEM files of a certificate and its key, before a server has them or while it does. `shown` is when the
/// certificate ends that a server showed, if any did.
std::vector<Finding> examine_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key,
                                         std::optional<std::chrono::sys_seconds> shown);

/// "12.3 GiB".
std::string in_units(double bytes);

}  // namespace tessera::client
