#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <set>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/film/pixels.h"

namespace tessera {

/// A job's image while and after it is rendered, in passes that each make it better. Different tiles may be stored at
/// once, by one thread each. Who reads while any is stored takes a `Snapshot`.
class Film {
 public:
  Film(std::uint32_t width, std::uint32_t height, const std::set<Aov>& aovs, std::vector<PixelRect> tiles);

  /// Replaces the pixels of tile `index`, all samples of which up to now these are.
  void store(std::size_t index, const Pixels& tile);

  std::size_t tile_count() const { return tiles_.size(); }

  /// How often each tile has been stored: what is between two equal answers is the same image.
  std::vector<std::uint32_t> versions() const;

  /// A copy of what is stored; tiles are whole, though they may be of different passes.
  struct Snapshot {
    Pixels pixels;                        ///< With `aovs` alone. Of tiles that aren't stored: nothing.
    std::vector<std::uint32_t> versions;  ///< Of the tiles as they are in it.
    std::vector<std::uint8_t> is_there;   ///< By pixels, 1 where the tile is stored.
  };
  Snapshot snapshot(const std::set<Aov>& aovs) const;

  /// The image, without a copy; not while anything is stored that is read. Pixels of tiles that aren't stored are
  /// nothing.
  const Pixels& pixels() const { return pixels_; }

  /// Bytes of a film of that size, before making it.
  static std::uint64_t memory_bytes(std::uint64_t width, std::uint64_t height, const std::set<Aov>& aovs);

 private:
  /// Tile i is read and written under lock i % kLocks.
  static constexpr std::size_t kLocks = 64;
  std::mutex& lock_of(std::size_t tile) const { return locks_[tile % kLocks]; }

  Pixels pixels_;
  std::vector<PixelRect> tiles_;
  std::vector<std::uint32_t> versions_;
  mutable std::array<std::mutex, kLocks> locks_;
};

}  // namespace tessera
