#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/film/passes.h"
#include "core/scene/settings.h"
#include "server/jobs/job.h"
#include "server/store/file_descriptor.h"

namespace tessera::server {

/// A tile as a pass has left it, and what the pass did for that.
struct StoredTile {
  Pixels pixels;
  Sums sums;
  Progress::Done done;
};

/// Where the passes over an image have come to.
struct StoredPasses {
  std::uint32_t pass = 0;  ///< The number of the one at hand: as many are complete.
  double seconds = 0;      ///< From the beginning of the first pass to that of this one.
  JobFigures figures;      ///< At its beginning.
  Pass current;
  std::vector<std::unique_ptr<StoredTile>> tiles;  ///< As they are; none for tiles of the first pass that isn't done.
  std::vector<bool> is_done;                       ///< Whether the pass at hand has been over the tile.
};

/// The tiles of a job on disk, so that the next daemon goes on where this one has ended: in the job's own folder a file
/// a pass, which grows by each tile that is done. Every record has its hash, so that one that was being written when
/// the daemon was killed is seen to be none. Files are written, and not synced before the next pass begins: what a
/// power cut takes of the last one is rendered again.
///
/// What fails is logged, and no more of this job's tiles are kept then: it is rendered all the same. `add` may be
/// called by any number of threads, the rest by one, while none adds.
class TileLog {
 public:
  /// In `folder`, which needn't exist, for an image of these tiles.
  TileLog(std::filesystem::path folder, const Settings& settings, std::vector<PixelRect> tiles);

  /// What is there; nothing where that isn't enough to go on from. To be called first, if at all.
  std::optional<StoredPasses> load();

  /// Begins a pass, which has the number `at.pass`: `at` needs no tiles. `passes` and `film` are as the passes before
  /// have left them. The first pass has no file before there is a tile for it.
  void begin(const StoredPasses& at, const Passes& passes, const Film& film);
  /// In place of that, for a pass that isn't worth it.
  void skip();
  void add(std::size_t index, const Pixels& pixels, const Sums& sums, const Progress::Done& done);

  /// Nobody needs them any more.
  void remove();

  static void remove(const std::filesystem::path& folder);

 private:
  class Reader;

  std::filesystem::path path_of(std::uint32_t pass) const { return folder_ / (std::to_string(pass) + ".tiles"); }
  void open(std::uint32_t pass, const std::string& header);
  void write(std::uint32_t index, const std::string& payload);
  void write_tile(std::size_t index, const Pixels& pixels, const Sums& sums, const Progress::Done& done);
  void give_up(const std::string& why);

  const std::filesystem::path folder_;
  const Settings settings_;
  const std::vector<PixelRect> tiles_;
  std::mutex mutex_;  ///< Guards what follows while tiles are added.
  bool given_up_ = false;
  std::string first_header_;  ///< Of the first pass, as long as it has no file.
  FileDescriptor file_;
  std::uint32_t pass_ = 0;  ///< Whose file that is.
  /// The file that has each tile as it was left by the last pass over it; none where none has.
  std::vector<std::optional<std::uint32_t>> written_in_;
};

}  // namespace tessera::server
