#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/accel/wide/lazy_tree.h"

namespace tessera::server {

/// Hierarchies of meshes in files, so that a daemon that starts anew doesn't build them again. Several daemons may
/// share a folder. A file is named for the mesh and for how it is built, is written whole or not at all, and is read
/// only if it is whole still: otherwise its mesh is built, and the file replaced. What goes wrong with the disk is
/// logged, and no more than that. Safe to use from any number of threads.
class WideStore {
 public:
  /// Keeps files of `limit` bytes together in `folder`, which is made if it is missing; the longest unused go. Other
  /// files in there are left alone: what an end at the wrong moment leaves half-written stays, too. Builds on
  /// `threads` threads (0: as many as the machine has). Throws std::filesystem::filesystem_error when it can't be made.
  WideStore(std::filesystem::path folder, std::uint64_t limit, unsigned threads);

  /// The hierarchy of a mesh, mapped from its file; or built, and put there. Throws what `build_wide` does.
  MadeTree get(const TriangleMesh& mesh) const;

 private:
  void keep(const std::string& key, const WideTree& tree) const;
  void evict() const;
  std::filesystem::path file_of(const std::string& key) const;

  const std::filesystem::path folder_;
  const std::uint64_t limit_;
  const unsigned threads_;
};

}  // namespace tessera::server
