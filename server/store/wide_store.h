#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/accel/wide/lazy_tree.h"
#include "server/store/shelf.h"

namespace tessera::server {

/// Hierarchies of meshes in files, so that a daemon that starts anew doesn't build them again. Several daemons may
/// share a folder. A file is named for the mesh and for how it is built, is written whole or not at all, and is used
/// only if it is whole still: otherwise it is set aside, and its mesh built again. What goes wrong with the disk is
/// logged, and no more than that. Safe to use from any number of threads.
class WideStore {
 public:
  /// Meshes of fewer triangles are built anew as fast as they are written, and a scene may have many of them: a mapping
  /// for each is more than some systems give.
  static constexpr std::size_t kWorthKeeping = 8192;

  /// Keeps files of `limit` bytes together in `folder`, which is made if it is missing; the longest unused go. Of other
  /// files in there those go that another end, at the wrong moment, left half-written an hour ago or earlier. Meshes of
  /// fewer triangles than `least` are built, and not kept. Builds on `threads` threads (0: as many as the machine has).
  /// Damaged files go to `set_aside`.
  /// Throws std::filesystem::filesystem_error when the folder can't be made or looked into.
  WideStore(std::filesystem::path folder, std::filesystem::path set_aside, std::uint64_t limit, unsigned threads,
            std::size_t least = kWorthKeeping);

  /// The hierarchy of a mesh, read from its file; or built, and put there. Throws what `build_wide` does.
  MadeTree get(const TriangleMesh& mesh) const;

  /// Looks through all files; `is_damaged` is told of each that is set aside. Throws StorageErrors.
  Shelf::Scrubbed scrub(const std::function<void(const std::filesystem::path& file)>& is_damaged) const;

 private:
  std::optional<WideTree> read(const std::string& key) const;
  void keep(const std::string& key, const WideTree& tree) const;
  void evict() const;
  void remove_left_over() const;
  std::filesystem::path file_of(const std::string& key) const;

  const std::filesystem::path folder_;
  const std::filesystem::path set_aside_;
  const std::uint64_t limit_;
  const unsigned threads_;
  const std::size_t least_;
};

}  // namespace tessera::server
