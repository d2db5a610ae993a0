#pragma once

#include <chrono>
#include <string>

namespace tessera::server {

/// A moment as RFC 3339 writes it, in UTC, with milliseconds: 2026-11-30T09:05:00.250Z. From year 0 to 9999.
std::string rfc3339(std::chrono::system_clock::time_point time);

}  // namespace tessera::server
