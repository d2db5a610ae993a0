#include "server/store/shelf.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/wire/abandoned.h"
#include "server/http/lane.h"
#include "server/store/file_descriptor.h"
#include "server/store/set_aside.h"
#include "server/store/storage_error.h"

namespace tessera::server {
namespace fs = std::filesystem;

namespace {

/// Of names and stamps of files that have been looked through.
constexpr std::uint64_t kMostChecks = 16 << 20;
/// The clocks of file systems may stand still for so long: what was changed since a moment before may be changed again
/// and look the same.
constexpr std::int64_t kClockTick = 100'000'000;
/// Uses are noted at most so often.
constexpr std::int64_t kBetweenNotes = 3600LL * 1'000'000'000;
constexpr std::size_t kNameDigits = 64;
constexpr const char* kChanged = "its content isn't what its name says";

std::int64_t nanoseconds(const timespec& time) { return time.tv_sec * 1'000'000'000LL + time.tv_nsec; }

std::int64_t now() {
  timespec time{};
  ::clock_gettime(CLOCK_REALTIME, &time);
  return nanoseconds(time);
}

}  // namespace

/// What tells whether a file is the one that was looked through.
struct Shelf::Stamp {
  bool is_file;
  std::uint64_t inode, bytes;
  std::int64_t written, changed;

  static Stamp of(const struct stat& status) {
    return {S_ISREG(status.st_mode) != 0, status.st_ino, static_cast<std::uint64_t>(status.st_size),
            nanoseconds(status.st_mtim), nanoseconds(status.st_ctim)};
  }
  static Stamp of(const FileDescriptor& file) {
    struct stat status;
    if (::fstat(file.value(), &status) != 0) throw_storage_error("cannot look at a file");
    return of(status);
  }
  bool operator==(const Stamp&) const = default;

  std::string key(const std::string& name) const {
    return name + ' ' + std::to_string(inode) + ' ' + std::to_string(bytes) + ' ' + std::to_string(written) + ' ' +
           std::to_string(changed);
  }
};

Shelf::Shelf(fs::path folder, std::string extension, IsWhole is_whole, fs::path set_aside)
    : folder_(std::move(folder)),
      extension_(std::move(extension)),
      is_whole_(is_whole),
      set_aside_(std::move(set_aside)),
      checks_(kMostChecks),
      tombstones_(folder_ / ".gone") {}

std::shared_ptr<const void> Shelf::hold(const std::string& name) {
  const auto let_go = [holds = holds_, name](const void*) {
    const std::lock_guard lock(holds->mutex);
    const auto found = holds->counts.find(name);
    if (--found->second == 0) holds->counts.erase(found);
  };
  {
    const std::lock_guard not_while_it_is_removed(changing_);
    const std::lock_guard lock(holds_->mutex);
    ++holds_->counts[name];
  }
  return {static_cast<const void*>(this), let_go};
}

bool Shelf::is_held(const std::string& name) const {
  const std::lock_guard lock(holds_->mutex);
  return holds_->counts.contains(name);
}

Shelf::Found Shelf::absent(const std::string& name) const {
  std::error_code error;
  if (!fs::is_directory(folder_, error)) throw StorageError(ENOENT, folder_.string() + " is gone");
  const auto fate = tombstones_.find(name);
  if (!fate) return {State::missing};
  return {*fate == Fate::expired ? State::expired : State::damaged};
}

Shelf::Found Shelf::find(const std::string& name, const std::stop_token& stop) {
  std::shared_ptr<const void> held = hold(name);  // Before it is looked for, so that nobody removes it in between.
  // Without O_NONBLOCK a pipe of that name would wait for somebody to write to it.
  const FileDescriptor file(::open(path_of(name).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file && errno == ENOENT) return absent(name);
  if (!file) throw_storage_error("cannot open " + path_of(name).string());
  const Stamp stamp = Stamp::of(file);
  if (!stamp.is_file) return absent(name);
  FileBudget::spend(stamp.bytes);
  if (!check(name, file, stamp, stop)) {
    set_aside_this(name, stamp.inode, kChanged);
    return {State::damaged};
  }
  note_use(name, file, stamp);
  return {State::whole, stamp.bytes, std::move(held)};
}

void Shelf::touch(const std::string& name) {
  const FileDescriptor file(::open(path_of(name).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file) note_use(name, file, Stamp::of(file));
}

bool Shelf::check(const std::string& name, const FileDescriptor& file, const Stamp& stamp,
                  const std::stop_token& stop) {
  const auto look = [&](const std::stop_token& unwanted) -> SingleFlight<bool>::Made {
    const bool is_whole = is_whole_(file.value(), name, unwanted);
    const bool is_settled = std::abs(now() - stamp.changed) > kClockTick && Stamp::of(file) == stamp;
    return {is_whole, is_settled ? std::optional<std::uint64_t>(0) : std::nullopt};
  };
  return checks_.get(stamp.key(name), look, stop);
}

/// The file's time says when it was used last. Where that can't be noted, it goes sooner.
void Shelf::note_use(const std::string& name, const FileDescriptor& file, const Stamp& stamp) {
  if (std::abs(now() - stamp.written) < kBetweenNotes) return;
  const bool is_known = checks_.find(stamp.key(name)).value_or(false);
  if (::futimens(file.value(), nullptr) == 0 && is_known)
    checks_.find_or_keep(Stamp::of(file).key(name), true, 0);  // What was looked through is what was touched.
}

bool Shelf::keep(const std::string& name, ReceivedFile& file, const std::stop_token& stop) {
  if (find(name, stop).state == State::whole) return true;
  replace(name, file);
  return false;
}

void Shelf::replace(const std::string& name, ReceivedFile& file) {
  file.keep_as(path_of(name), &changing_);
  tombstones_.remove(name);
  kept_bytes_ += file.size();
}

bool Shelf::has_outgrown(const Limits& limits) const {
  return limits.bytes > 0 && kept_bytes_ > 0 && swept_bytes_ + kept_bytes_ > limits.bytes;
}

void Shelf::set_aside_as_damaged(const std::string& name, std::string_view why) {
  struct stat status;
  if (::stat(path_of(name).c_str(), &status) == 0) set_aside_this(name, status.st_ino, why);
}

/// Unless another file has that name by now.
void Shelf::set_aside_this(const std::string& name, std::uint64_t inode, std::string_view why) {
  const std::lock_guard lock(changing_);
  struct stat status;
  if (::stat(path_of(name).c_str(), &status) != 0 || status.st_ino != inode) return;
  if (!set_aside(path_of(name), set_aside_, why).empty()) tombstones_.add(name, Fate::damaged);
}

Shelf::Removal Shelf::remove(const std::string& name, const std::function<bool()>& is_needed) {
  {
    const std::lock_guard lock(changing_);
    if (is_held(name)) return Removal::held;
    if (::access(path_of(name).c_str(), F_OK) == 0) {
      if (is_needed()) return Removal::needed;
      if (::unlink(path_of(name).c_str()) != 0) throw_storage_error("cannot remove " + path_of(name).string());
      tombstones_.remove(name);
      return Removal::removed;
    }
    if (errno != ENOENT) throw_storage_error("cannot look at " + path_of(name).string());
  }
  return absent(name).state == State::expired ? Removal::expired : Removal::missing;
}

std::vector<std::string> Shelf::names() const {
  std::error_code error;
  std::vector<std::string> names;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
    const std::string file = entry->path().filename().string();
    if (file.size() != kNameDigits + extension_.size() || !file.ends_with(extension_)) continue;
    names.push_back(file.substr(0, kNameDigits));
    if (!std::ranges::all_of(names.back(), [](char c) { return ('0' <= c && c <= '9') || ('a' <= c && c <= 'f'); }))
      names.pop_back();
  }
  if (error) throw StorageError(error.value(), "cannot look into " + folder_.string());
  return names;
}

Shelf::Swept Shelf::sweep(const Limits& limits, const std::function<bool(const std::string& name)>& is_needed,
                          const std::stop_token& stop) {
  struct File {
    std::string name;
    std::uint64_t bytes;
    std::int64_t used;
  };
  std::vector<File> files;
  std::uint64_t sum = 0;
  kept_bytes_ = 0;
  for (std::string& name : names()) {
    struct stat status;
    if (stop.stop_requested()) return {};
    if (::stat(path_of(name).c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    sum += static_cast<std::uint64_t>(status.st_size);
    files.push_back({std::move(name), static_cast<std::uint64_t>(status.st_size), nanoseconds(status.st_mtim)});
  }
  std::ranges::sort(files, {}, &File::used);
  const std::int64_t oldest = now() - std::chrono::nanoseconds(limits.age).count();
  Swept swept;
  for (const File& file : files) {
    const bool is_too_old = limits.age.count() > 0 && file.used < oldest;
    if (!is_too_old && (limits.bytes == 0 || sum <= limits.bytes)) break;
    if (stop.stop_requested()) break;
    const std::lock_guard lock(changing_);
    const std::string path = path_of(file.name).string();
    struct stat status;
    const bool was_used = ::stat(path.c_str(), &status) != 0 || nanoseconds(status.st_mtim) != file.used;
    if (was_used || is_held(file.name) || is_needed(file.name)) continue;
    tombstones_.add(file.name, Fate::expired);  // Before it is gone, so that nobody is told that it never was there.
    if (::unlink(path.c_str()) != 0) {
      tombstones_.remove(file.name);
      continue;
    }
    sum -= file.bytes;
    swept.names.push_back(file.name);
    swept.bytes += file.bytes;
  }
  swept_bytes_ = sum;
  return swept;
}

Shelf::Scrubbed Shelf::scrub(const std::function<void(const fs::path& file)>& is_damaged) {
  Scrubbed scrubbed;
  for (const std::string& name : names()) {
    const FileDescriptor file(::open(path_of(name).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!file) throw_storage_error("cannot open " + path_of(name).string());
    const Stamp stamp = Stamp::of(file);
    if (!stamp.is_file) continue;
    ++scrubbed.files;
    scrubbed.bytes += stamp.bytes;
    if (is_whole_(file.value(), name, {})) continue;
    ++scrubbed.damaged;
    set_aside_this(name, stamp.inode, kChanged);
    is_damaged(path_of(name));
  }
  return scrubbed;
}

}  // namespace tessera::server
