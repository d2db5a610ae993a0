#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>

#include "proto/wire/problem.h"
#include "server/store/storage_error.h"

namespace tessera::server {

/// The disk under the data folder, as it was looked at last.
struct StoreHealth {
  bool writable = true;
  std::string problem;           ///< Why it isn't; empty where it is.
  std::uint64_t free_bytes = 0;  ///< For who runs the server; 0 where that can't be told.
  std::string last_refusal;      ///< What the disk refused last, and why; empty where it never did.
  std::uint64_t refusals = 0;    ///< How often it has.
};

/// Knows how the data folder's disk is. Safe to use from any number of threads.
class StoreWatch {
 public:
  /// `folder` is one of those that files are written to.
  explicit StoreWatch(std::filesystem::path folder);

  /// What the last look saw: takes no time.
  StoreHealth health() const;

  /// Looks whether a file can be made and written, which leaves nothing there.
  void look();

  /// The disk has refused something: logs that, notes it, and gives what the client is told.
  proto::Problem refuse(const StorageError& error);

 private:
  const std::filesystem::path folder_;
  mutable std::mutex mutex_;  ///< Guards what follows; nothing is called while it is held.
  StoreHealth health_;
};

}  // namespace tessera::server
