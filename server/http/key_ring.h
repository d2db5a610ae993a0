#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "proto/wire/key_file.h"
#include "proto/wire/result.h"
#include "server/http/principal.h"

namespace tessera::server {

/// The keys of the data folder, as they were when they were read last. Safe to use from any number of threads.
class KeyRing {
 public:
  /// Reads them. Throws std::runtime_error when the file can't be used.
  KeyRing(std::filesystem::path data_dir, bool required);

  /// Reads them again; how many there are. When that throws, they are as they were.
  std::size_t reload();

  /// Neither are there keys, nor have there been since the start, nor are they required: everybody may do everything.
  bool is_open() const;

  /// Whose key an Authorization header shows (RFC 6750, 2.1), or `unauthorized`, in words that don't say whether there
  /// is such a key.
  proto::Result<Principal> find(std::optional<std::string_view> authorization) const;

 private:
  using Keys = std::map<std::string, std::shared_ptr<const proto::Key>, std::less<>>;

  const std::filesystem::path data_dir_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  bool is_open_;
  std::shared_ptr<const Keys> keys_;  ///< By id.
};

}  // namespace tessera::server
