#include "server/store/owners.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>

#include "server/store/file_descriptor.h"
#include "server/store/received_file.h"
#include "server/store/storage_error.h"

namespace tessera::server {
namespace fs = std::filesystem;

namespace {

constexpr std::string_view kKindOfHash = "sha256:";

std::string digits_of(const proto::ContentHash& hash) { return hash.substr(kKindOfHash.size()); }

/// Hash and size by a file's name; nothing for a file of others.
std::optional<std::pair<std::string, std::uint64_t>> read_name(const std::string& name) {
  const std::size_t dot = name.find('.');
  const std::string digits = name.substr(0, dot);
  if (dot == std::string::npos || !proto::is_content_hash(std::string(kKindOfHash) + digits)) return std::nullopt;
  std::uint64_t bytes = 0;
  const char* const end = name.data() + name.size();
  const auto [read_to, error] = std::from_chars(name.data() + dot + 1, end, bytes);
  if (error != std::errc() || read_to != end) return std::nullopt;
  return std::pair(digits, bytes);
}

}  // namespace

Owners::Owners(fs::path folder) : folder_(std::move(folder)) {
  fs::create_directories(folder_);
  for (const auto& owner : fs::directory_iterator(folder_)) {
    if (!owner.is_directory()) continue;
    Holding& holding = holdings_[owner.path().filename().string()];
    for (const auto& file : fs::directory_iterator(owner.path())) {
      const auto held = read_name(file.path().filename().string());
      if (held && holding.bytes.insert(*held).second) holding.total += held->second;
    }
  }
}

void Owners::add(const std::string& owner, const proto::ContentHash& hash, std::uint64_t bytes) {
  if (owner.empty() || (has(owner, hash) && (bytes_of(owner, hash) > 0 || bytes == 0))) return;
  remove(owner, hash);  // Of what had expired.
  const fs::path folder = folder_ / owner;
  if (fs::create_directory(folder)) sync_folder(folder_);
  const fs::path path = folder / (digits_of(hash) + '.' + std::to_string(bytes));
  const FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600));
  if (!file) throw_storage_error("cannot make " + path.string());
  sync_folder(folder);
  const std::lock_guard lock(mutex_);
  Holding& holding = holdings_[owner];
  if (holding.bytes.emplace(digits_of(hash), bytes).second) holding.total += bytes;
}

void Owners::remove(const std::string& owner, const proto::ContentHash& hash) {
  std::uint64_t bytes = 0;
  {
    const std::lock_guard lock(mutex_);
    const auto holding = holdings_.find(owner);
    if (holding == holdings_.end()) return;
    const auto held = holding->second.bytes.find(digits_of(hash));
    if (held == holding->second.bytes.end()) return;
    bytes = held->second;
    holding->second.total -= bytes;
    holding->second.bytes.erase(held);
  }
  fs::remove(folder_ / owner / (digits_of(hash) + '.' + std::to_string(bytes)));
}

std::vector<std::string> Owners::owners_of(const proto::ContentHash& hash) const {
  std::vector<std::string> owners;
  const std::lock_guard lock(mutex_);
  for (const auto& [owner, holding] : holdings_)
    if (holding.bytes.contains(digits_of(hash))) owners.push_back(owner);
  return owners;
}

void Owners::forget(const proto::ContentHash& hash) {
  for (const std::string& owner : owners_of(hash)) remove(owner, hash);
}

void Owners::expire(const proto::ContentHash& hash, const std::function<bool()>& is_there) {
  const std::string digits = digits_of(hash);
  std::vector<fs::path> changed;
  {
    const std::lock_guard lock(mutex_);
    if (is_there()) return;
    for (auto& [owner, holding] : holdings_) {
      const auto held = holding.bytes.find(digits);
      if (held == holding.bytes.end() || held->second == 0) continue;
      const std::string path = (folder_ / owner / digits).string();
      fs::rename(path + '.' + std::to_string(held->second), path + ".0");
      holding.total -= std::exchange(held->second, 0);
      changed.push_back(folder_ / owner);
    }
  }
  for (const fs::path& folder : changed) sync_folder(folder);
}

bool Owners::has_others(const std::string& owner, const proto::ContentHash& hash) const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(holdings_, [&](const auto& holding) {
    const auto held = holding.second.bytes.find(digits_of(hash));
    return holding.first != owner && held != holding.second.bytes.end() && held->second > 0;
  });
}

bool Owners::has(const std::string& owner, const proto::ContentHash& hash) const {
  if (!proto::is_content_hash(hash)) return false;
  const std::lock_guard lock(mutex_);
  const auto found = holdings_.find(owner);
  return found != holdings_.end() && found->second.bytes.contains(digits_of(hash));
}

std::uint64_t Owners::bytes_of(const std::string& owner) const {
  const std::lock_guard lock(mutex_);
  const auto found = holdings_.find(owner);
  return found == holdings_.end() ? 0 : found->second.total;
}

std::uint64_t Owners::bytes_of(const std::string& owner, const proto::ContentHash& hash) const {
  if (!proto::is_content_hash(hash)) return 0;
  const std::lock_guard lock(mutex_);
  const auto holding = holdings_.find(owner);
  if (holding == holdings_.end()) return 0;
  const auto held = holding->second.bytes.find(digits_of(hash));
  return held == holding->second.bytes.end() ? 0 : held->second;
}

}  // namespace tessera::server
