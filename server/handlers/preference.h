#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "server/http/request.h"

namespace tessera::server {

/// How long a client wants to wait (RFC 7240).
struct Preference {
  bool respond_async = false;
  std::optional<std::chrono::seconds> wait;

  /// As it is told to have been followed.
  std::string applied() const;
  /// Nothing for as long as it takes.
  std::optional<std::chrono::steady_clock::time_point> until(std::chrono::steady_clock::time_point begin) const;
};

/// Preferences that aren't known, or make no sense, are passed over, as the RFC has it.
Preference read_preference(const Request& request);

}  // namespace tessera::server
