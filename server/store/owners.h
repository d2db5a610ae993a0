#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "proto/wire/sha256.h"

namespace tessera::server {

/// Who has put which blobs and scenes, by hash. Kept as empty files, `<folder>/<owner>/<64 digits>.<bytes>`, one for
/// each: there or not, and never half written. Nobody's, which is what is put without keys, aren't kept. Safe to use
/// from any number of threads.
class Owners {
 public:
  /// Reads who has what in `folder`, which is made where it is missing. Throws std::system_error.
  explicit Owners(std::filesystem::path folder);

  /// From now on `owner` has this, of so many bytes, whatever happens. Throws std::system_error.
  void add(const std::string& owner, const proto::ContentHash& hash, std::uint64_t bytes);

  /// It isn't the owner's any more. Throws std::system_error.
  void remove(const std::string& owner, const proto::ContentHash& hash);
  /// It is nobody's any more.
  void forget(const proto::ContentHash& hash);

  /// It has expired: its bytes are nobody's any more, but those who had it are told what became of it. Unless it has
  /// been put again since, of which `is_there` tells: who puts it is added once it is there.
  void expire(const proto::ContentHash& hash, const std::function<bool()>& is_there);

  /// Whether somebody else has it, too, and it hasn't expired.
  bool has_others(const std::string& owner, const proto::ContentHash& hash) const;
  bool has(const std::string& owner, const proto::ContentHash& hash) const;

  /// Of all that `owner` has.
  std::uint64_t bytes_of(const std::string& owner) const;
  /// Of this; none of what has expired, or of what is no hash.
  std::uint64_t bytes_of(const std::string& owner, const proto::ContentHash& hash) const;

 private:
  std::vector<std::string> owners_of(const proto::ContentHash& hash) const;

  struct Holding {
    std::map<std::string, std::uint64_t, std::less<>> bytes;  ///< By the digits of hashes.
    std::uint64_t total = 0;
  };

  const std::filesystem::path folder_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::map<std::string, Holding, std::less<>> holdings_;
};

}  // namespace tessera::server
