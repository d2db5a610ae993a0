#pragma once

#include <cstdint>
#include <string>

#include "proto/wire/result.h"
#include "server/single_flight.h"

namespace tessera::server {

/// Ids of jobs by the hash of all that their images depend on, so that what is asked for again is rendered once.
class KnownJobs : public SingleFlight<proto::Result<std::string>> {
 public:
  KnownJobs() : SingleFlight(kMostBytes) {}

 private:
  static constexpr std::uint64_t kMostBytes = 16 << 20;
};

}  // namespace tessera::server
