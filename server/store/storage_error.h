#pragma once

#include <string>
#include <system_error>

#include "proto/wire/problem.h"

namespace tessera::server {

/// What the disk, or the folder on it, refused.
class StorageError : public std::system_error {
 public:
  /// `what` says what couldn't be done, with which file.
  StorageError(int error, const std::string& what) : std::system_error(error, std::generic_category(), what) {}
};

/// With what errno says.
[[noreturn]] void throw_storage_error(const std::string& what);

/// Logs what the disk has refused, and gives what a client is told: `insufficient_storage` where there is no room (the
/// disk, a quota or a limit for files is full), `storage_unavailable` for all else.
proto::Problem refuse(const StorageError& error);

}  // namespace tessera::server
