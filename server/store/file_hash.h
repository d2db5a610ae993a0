#pragma once

#include <cstdint>
#include <stop_token>

#include "proto/wire/sha256.h"

namespace tessera::server {

/// The hash of an open file from a place on. Throws `Abandoned` once a stop is requested, and StorageErrors.
proto::ContentHash hash_open_file(int file, std::uint64_t from, const std::stop_token& stop);

}  // namespace tessera::server
