#include "server/wide_store.h"

#include <algorithm>
#include <cctype>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "core/accel/wide/wide_build.h"
#include "server/received_file.h"
#include "server/wide_file.h"

namespace tessera::server {
namespace fs = std::filesystem;

namespace {

/// Whether a daemon has put it there, whole or half-written. What else lies in the folder isn't ours to remove.
bool is_ours(const fs::path& path) {
  const std::string name = path.filename().string();
  const auto is_digit = [](unsigned char c) { return std::isxdigit(c) != 0; };
  return name.starts_with(kReceivedFilePrefix) || (name.size() == 64 && std::ranges::all_of(name, is_digit));
}

}  // namespace

WideStore::WideStore(fs::path folder, std::uint64_t limit) : folder_(std::move(folder)), limit_(limit) {
  fs::create_directories(folder_);
}

MadeTree WideStore::get(const TriangleMesh& mesh) const {
  const std::string key = wide_key(mesh);
  try {
    if (auto tree = map_wide_file(folder_ / key, key)) return {*std::move(tree), true};
  } catch (const std::runtime_error& error) {
    spdlog::warn("{}: {}; its mesh is built again", (folder_ / key).string(), error.what());
  }
  MadeTree made{build_wide(mesh)};
  keep(key, made.tree);
  return made;
}

void WideStore::keep(const std::string& key, const WideTree& tree) const {
  if (wide_file_bytes(tree) > limit_) return;
  try {
    write_wide_file(folder_ / key, key, tree);
    evict();
  } catch (const std::system_error& error) {  // A full disk, say.
    spdlog::warn("a mesh's hierarchy isn't kept: {}", error.what());
  }
}

/// What daemons have left half-written is a file like any other, and goes in its turn. Another daemon may remove files
/// at the same time, so that one that is gone is no error.
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
    if (gone || unsized || !is_ours(entry.path())) continue;
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
