#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

namespace tessera::proto {

/// A content hash as it stands on the wire: "sha256:" and 64 lower-case hex digits.
using ContentHash = std::string;

bool is_content_hash(std::string_view text);

/// Hashes bytes as they arrive. One thread at a time.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void update(std::span<const std::byte> bytes);
  void update(std::string_view text);

  /// The hash of everything so far; no update may follow.
  ContentHash finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

ContentHash content_hash(std::string_view text);

/// The hash of a whole file; nothing when it can't be read to its end, or a stop is requested before that.
std::optional<ContentHash> hash_file(const std::filesystem::path& path, const std::stop_token& stop = {});

}  // namespace tessera::proto
