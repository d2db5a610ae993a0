#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

namespace tessera::server {

/// Why something isn't there any more.
enum class Fate { expired, damaged };

/// What became of files that were there once, by their names: the last so many. They outlive the process as far as
/// the disk allows; where it doesn't, or loses them, something is just not there. Safe to use from any number of
/// threads.
class Tombstones {
 public:
  static constexpr std::size_t kMost = 10'000;

  /// Kept in `file`, which needn't be there.
  explicit Tombstones(std::filesystem::path file, std::size_t most = kMost);

  void add(const std::string& name, Fate fate);
  /// It is there again, or was deleted by who knows of it.
  void remove(const std::string& name);
  std::optional<Fate> find(const std::string& name) const;

 private:
  void load();
  void set(const std::string& name, Fate fate);
  void append(char mark, const std::string& name);
  void rewrite();

  const std::filesystem::path file_;
  const std::size_t most_;
  mutable std::mutex mutex_;  ///< Guards what follows, and the file; nothing else is called while it is held.
  std::unordered_map<std::string, Fate> fates_;
  std::deque<std::string> order_;  ///< The names, and some that were removed, the oldest first.
  std::size_t lines_ = 0;          ///< In the file.
};

}  // namespace tessera::server
