#pragma once

#include <map>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

namespace tessera::server {

/// Which blobs stored scenes name. Safe to use from any number of threads; calls nothing.
class BlobReferences {
 public:
  /// The scene names these blobs, and none that it named before.
  void set(const std::string& scene, std::vector<std::string> blobs) {
    const std::lock_guard lock(mutex_);
    drop_locked(scene);
    for (const std::string& blob : blobs) ++counts_[blob];
    blobs_[scene] = std::move(blobs);
  }

  void drop(const std::string& scene) {
    const std::lock_guard lock(mutex_);
    drop_locked(scene);
  }

  bool is_named(const std::string& blob) const {
    const std::lock_guard lock(mutex_);
    return counts_.contains(blob);
  }

 private:
  void drop_locked(const std::string& scene) {
    const auto found = blobs_.find(scene);
    if (found == blobs_.end()) return;
    for (const std::string& blob : found->second)
      if (const auto count = counts_.find(blob); --count->second == 0) counts_.erase(count);
    blobs_.erase(found);
  }

  mutable std::mutex mutex_;
  std::map<std::string, std::vector<std::string>> blobs_;  ///< By scene.
  std::unordered_map<std::string, unsigned> counts_;       ///< By blob: of how many scenes.
};

}  // namespace tessera::server
