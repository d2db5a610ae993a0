#include "server/store/wide_store.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "core/accel/wide/wide_build.h"
#include "server/store/received_file.h"
#include "server/store/set_aside.h"
#include "server/store/storage_error.h"
#include "server/store/wide_file.h"

namespace tessera::server {
namespace fs = std::filesystem;

namespace {

/// What else lies in the folder, uploads even, isn't ours to remove.
constexpr const char* kExtension = ".wide";

}  // namespace

WideStore::WideStore(fs::path folder, fs::path set_aside, std::uint64_t limit, unsigned threads, std::size_t least)
    : folder_(std::move(folder)), set_aside_(std::move(set_aside)), limit_(limit), threads_(threads), least_(least) {
  fs::create_directories(folder_);
  remove_left_over();
}

/// What is younger may be another daemon's, which is writing it.
void WideStore::remove_left_over() const {
  const auto then = fs::file_time_type::clock::now() - std::chrono::hours(1);
  for (const auto& entry : fs::directory_iterator(folder_)) {
    if (!entry.path().filename().string().starts_with(kReceivedFilePrefix)) continue;
    std::error_code gone, ignored;
    const fs::file_time_type written = entry.last_write_time(gone);
    if (!gone && written < then) fs::remove(entry.path(), ignored);
  }
}

MadeTree WideStore::get(const TriangleMesh& mesh) const {
  if (mesh.triangles.size() < least_) return {build_wide(mesh, {.threads = threads_})};
  const std::string key = wide_key(mesh);
  if (auto tree = read(key)) return {*std::move(tree), true};
  MadeTree made{build_wide(mesh, {.threads = threads_})};
  keep(key, made.tree);
  return made;
}

std::optional<WideTree> WideStore::read(const std::string& key) const {
  try {
    return read_wide_file(file_of(key), key);
  } catch (const DamagedFile& damage) {
    try {
      set_aside(file_of(key), set_aside_, damage.what());
    } catch (const std::system_error& error) {
      spdlog::error("{}: {}, and it stays in its place: {}", file_of(key).string(), damage.what(), error.what());
    }
  } catch (const std::system_error& error) {
    spdlog::warn("{}: {}; its mesh is built again", file_of(key).string(), error.what());
  }
  return std::nullopt;
}

Shelf::Scrubbed WideStore::scrub(const std::function<void(const fs::path& file)>& is_damaged) const {
  Shelf::Scrubbed scrubbed;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path& file = entry->path();
    std::error_code ignored;
    if (file.extension() != kExtension || !entry->is_regular_file(ignored)) continue;
    ++scrubbed.files;
    scrubbed.bytes += entry->file_size(ignored);
    try {
      read_wide_file(file, file.stem().string());
    } catch (const DamagedFile& damage) {
      ++scrubbed.damaged;
      set_aside(file, set_aside_, damage.what());
      is_damaged(file);
    }
  }
  if (error) throw StorageError(error.value(), "cannot look into " + folder_.string());
  return scrubbed;
}

void WideStore::keep(const std::string& key, const WideTree& tree) const {
  if (wide_file_bytes(tree) > limit_) return;
  try {
    write_wide_file(file_of(key), key, tree);
    evict();
  } catch (const std::system_error& error) {  // A full disk, say.
    spdlog::warn("a mesh's hierarchy isn't kept: {}", error.what());
  }
}

fs::path WideStore::file_of(const std::string& key) const { return folder_ / (key + kExtension); }

/// Another daemon may remove files at the same time, so that one that is gone is no error.
void WideStore::evict() const {
  struct File {
    fs::file_time_type used;
    std::uint64_t bytes;
    fs::path path;
  };
  std::vector<File> files;
  std::uint64_t sum = 0;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    std::error_code gone, unsized;
    const File file{entry.last_write_time(gone), entry.file_size(unsized), entry.path()};
    if (gone || unsized || entry.path().extension() != kExtension) continue;
    sum += file.bytes;
    files.push_back(file);
  }
  std::ranges::sort(files, {}, &File::used);
  for (const File& file : files) {
    if (sum <= limit_) return;
    std::error_code ignored;
    fs::remove(file.path, ignored);
    sum -= file.bytes;
  }
}

}  // namespace tessera::server
