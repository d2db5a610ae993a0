#include "server/store/tombstones.h"

#include <fstream>
#include <system_error>
#include <utility>

namespace tessera::server {
namespace fs = std::filesystem;

namespace {

// What a line of the file begins with; a name follows.
constexpr char kExpired = '-';
constexpr char kDamaged = '!';
constexpr char kBack = '+';

char mark_of(Fate fate) { return fate == Fate::expired ? kExpired : kDamaged; }

}  // namespace

Tombstones::Tombstones(fs::path file, std::size_t most) : file_(std::move(file)), most_(most) { load(); }

void Tombstones::add(const std::string& name, Fate fate) {
  const std::lock_guard lock(mutex_);
  set(name, fate);
  append(mark_of(fate), name);
}

void Tombstones::remove(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (fates_.erase(name) > 0) append(kBack, name);
}

std::optional<Fate> Tombstones::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = fates_.find(name);
  return found == fates_.end() ? std::nullopt : std::optional(found->second);
}

void Tombstones::load() {
  std::ifstream file(file_);
  for (std::string line; std::getline(file, line); ++lines_) {
    if (line.size() < 2) continue;
    const std::string name = line.substr(1);
    if (line.front() == kBack) fates_.erase(name);
    if (line.front() == kExpired) set(name, Fate::expired);
    if (line.front() == kDamaged) set(name, Fate::damaged);
  }
}

void Tombstones::set(const std::string& name, Fate fate) {
  if (fates_.insert_or_assign(name, fate).second) order_.push_back(name);
  while (order_.size() > most_) {
    fates_.erase(order_.front());
    order_.pop_front();
  }
}

void Tombstones::append(char mark, const std::string& name) {
  if (lines_ >= 2 * most_) return rewrite();
  std::ofstream(file_, std::ios::app) << mark << name << '\n';
  ++lines_;
}

void Tombstones::rewrite() {
  std::deque<std::string> order;
  fs::path fresh = file_;
  fresh += ".new";
  std::ofstream file(fresh);
  for (const std::string& name : order_) {
    const auto found = fates_.find(name);
    if (found == fates_.end()) continue;
    file << mark_of(found->second) << name << '\n';
    order.push_back(name);
  }
  file.close();
  std::error_code ignored;
  if (file) fs::rename(fresh, file_, ignored);
  order_ = std::move(order);
  lines_ = order_.size();
}

}  // namespace tessera::server
