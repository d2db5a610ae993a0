#pragma once

#include <cstddef>
#include <filesystem>
#include <utility>
#include <vector>

#include "server/store/tile_log.h"

namespace tessera::server {

inline const std::vector<PixelRect> kTiles{{0, 0, 20, 24}, {20, 0, 40, 24}};

inline Settings logged_settings() {
  Settings settings;
  settings.width = 40;
  settings.height = 24;
  settings.samples = 40;
  settings.aovs = {Aov::depth, Aov::variance, Aov::albedo};
  settings.error = 0.1F;
  return settings;
}

/// An image in passes whose tiles are logged, each with values that only it and its pass have.
struct Logged {
  explicit Logged(std::filesystem::path folder) : log(std::move(folder), settings, kTiles) {}

  void begin() {
    StoredPasses at{passes.report().passes, 1.5 * passes.report().passes, {}, passes.current(), {}, {}};
    at.figures.samples = passes.report().samples;
    at.figures.passes = passes.report();
    log.begin(at, passes, film);
  }
  void store(std::size_t tile) {
    Pixels pixels(kTiles[tile], settings.aovs);
    Sums sums(kTiles[tile], settings);
    const float value = static_cast<float>(passes.report().passes) * 10 + static_cast<float>(tile);
    for (std::size_t i = 0; i < pixels.color.size(); ++i) {
      pixels.color[i] = {value, static_cast<float>(i), 0};
      pixels.record(Aov::depth, i, value + 1);
      sums.totals.color[i] = {value, value, static_cast<float>(i)};
      sums.second[i] = {value + 2, value, 0};
      sums.mean[i] = {value, 0, 0};
      sums.squares[i] = {0, value, 0};
    }
    film.store(tile, pixels);
    passes.store(sums);
    Progress::Done done;
    done.samples = 100 + tile;
    log.add(tile, pixels, sums, done);
  }

  Settings settings = logged_settings();
  Passes passes{settings};
  Film film{settings.width, settings.height, settings.aovs, kTiles};
  TileLog log;
};

}  // namespace tessera::server
