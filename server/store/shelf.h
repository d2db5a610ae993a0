#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "server/store/received_file.h"
#include "server/store/single_flight.h"
#include "server/store/tombstones.h"

namespace tessera::server {

/// A folder of files, each named by 64 hex digits that tell what it has to hold. A file is looked through before it is
/// used first, and whenever it isn't the one any more that was looked through, by its inode, size and times; one that
/// isn't whole is set aside. Safe to use from any number of threads; reading takes its time.
///
/// The disk's refusals are StorageErrors.
class Shelf {
 public:
  /// Whether an open file holds what its name says. Throws `Abandoned` once that is requested, and StorageErrors.
  using IsWhole = bool (*)(int file, const std::string& name, const std::stop_token& stop);

  /// Files `<name><extension>` in `folder`, which exists; damaged ones go to `set_aside`.
  Shelf(std::filesystem::path folder, std::string extension, IsWhole is_whole, std::filesystem::path set_aside);

  std::filesystem::path path_of(const std::string& name) const { return folder_ / (name + extension_); }

  enum class State { whole, missing, expired, damaged };
  struct Found {
    State state;
    std::uint64_t bytes = 0;
    std::shared_ptr<const void> hold = nullptr;  ///< Of a whole one: it isn't removed as long as this lives.
  };
  /// Looks for a file, and notes that it was used; spends its bytes of the thread's FileBudget. Throws `Abandoned` once
  /// that is requested, and TooHeavy.
  Found find(const std::string& name, const std::stop_token& stop);

  /// Notes that a file was used, if it is there.
  void touch(const std::string& name);

  /// As long as this lives, no file of that name is removed.
  std::shared_ptr<const void> hold(const std::string& name);

  /// Puts a file there, unless it is there and whole, which it returns. Throws as `find` does.
  bool keep(const std::string& name, ReceivedFile& file, const std::stop_token& stop);
  /// The same in place of any that is there.
  void replace(const std::string& name, ReceivedFile& file);

  /// A file turned out to be damaged in a way that `IsWhole` can't see.
  void set_aside_as_damaged(const std::string& name, std::string_view why);

  enum class Removal { removed, missing, expired, held, needed };
  /// Removes a file, unless it is held or `is_needed`, which is asked when nobody can find it meanwhile.
  Removal remove(const std::string& name, const std::function<bool()>& is_needed);

  /// What may stay: 0 is no limit.
  struct Limits {
    std::uint64_t bytes = 0;      ///< Of all files; the longest unused give way.
    std::chrono::seconds age{0};  ///< Since a file was used.
  };
  struct Swept {
    std::vector<std::string> names;  ///< Of what went.
    std::uint64_t bytes = 0;
  };
  /// Removes what goes beyond the limits, but for what is held or needed.
  Swept sweep(const Limits& limits, const std::function<bool(const std::string& name)>& is_needed,
              const std::stop_token& stop);

  /// Whether files have been kept since it was swept last that may go beyond the limit of bytes.
  bool has_outgrown(const Limits& limits) const;

  /// The names of all files that are there.
  std::vector<std::string> names() const;

  /// Looks through all files, whatever is known of them. Tells which were damaged, and where they lie now.
  struct Scrubbed {
    std::uint64_t files = 0, bytes = 0, damaged = 0;
  };
  Scrubbed scrub(const std::function<void(const std::filesystem::path& file)>& is_damaged);

 private:
  struct Stamp;
  /// Files that are in use, by how many.
  struct Holds {
    std::mutex mutex;
    std::map<std::string, unsigned> counts;
  };

  bool is_held(const std::string& name) const;
  Found absent(const std::string& name) const;
  bool check(const std::string& name, const FileDescriptor& file, const Stamp& stamp, const std::stop_token& stop);
  void note_use(const std::string& name, const FileDescriptor& file, const Stamp& stamp);
  void set_aside_this(const std::string& name, std::uint64_t inode, std::string_view why);

  const std::filesystem::path folder_;
  const std::string extension_;
  const IsWhole is_whole_;
  const std::filesystem::path set_aside_;
  SingleFlight<bool> checks_;  ///< By name and stamp: whether that file is whole.
  Tombstones tombstones_;
  const std::shared_ptr<Holds> holds_ = std::make_shared<Holds>();
  std::atomic<std::uint64_t> swept_bytes_ = 0, kept_bytes_ = 0;  ///< When it was swept last, and kept since.
  std::mutex changing_;  ///< Held while a name changes its file, so that nobody removes another one than was meant.
};

}  // namespace tessera::server
