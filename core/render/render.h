#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <stop_token>

#include "core/accel/accel.h"
#include "core/film/film.h"
#include "core/film/sums.h"
#include "core/integrator/ray_counts.h"
#include "core/light/light_table.h"
#include "core/plan/plan.h"
#include "core/sampling/pixel_filter.h"
#include "core/sampling/sampler.h"
#include "core/scene/scene.h"
#include "core/scene/settings.h"
#include "core/screen/camera_rays.h"

namespace tessera {

/// How many samples tiles had better trace together: few at first, and fewer where rays turn out to be dear. It is a
/// matter of time alone; no pixel depends on it.
using ChunkSize = std::atomic<std::size_t>;

/// Everything that rendering a tile reads; shared by all threads of a job. Immutable but for the marks and the chunks.
struct RenderContext {
  RenderContext(std::shared_ptr<const Scene> scene, std::shared_ptr<const Accel> accel, const Settings& settings,
                Plan plan, const CameraRays& rays);
  /// With lights that are there already, or will be set.
  RenderContext(std::shared_ptr<const Scene> scene, std::shared_ptr<const Accel> accel, const Settings& settings,
                Plan plan, const CameraRays& rays, std::shared_ptr<const LightTable> lights);

  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Accel> accel;  ///< Null where the plan needs none (`needs_structure`).
  Settings settings;
  Plan plan;
  CameraRays rays;
  Sampler sampler;
  PixelFilter filter;
  std::shared_ptr<const LightTable> lights;       ///< Null where the plan needs none (`needs_lights`).
  std::shared_ptr<ObjectMarks> tested = nullptr;  ///< Told which objects are tested; null when nobody asks.
  std::shared_ptr<ChunkSize> chunk = std::make_shared<ChunkSize>(64);
};

struct TileResult {
  Pixels pixels;
  Sums sums;
  RayCounts rays;
  TestCounts tests;  ///< Of all those rays; zeros unless `counts_tests(settings)`.
};

/// Whether tests are counted: because the settings say so, or a cost plane wants them. Otherwise counting costs
/// nothing.
bool counts_tests(const Settings& settings);

/// Renders what a pass asks of tile `index` of the plan: a pure function of its arguments, safe to call from any
/// thread. Nothing when `stop` was requested before it was done. `TileRenderer` does the same in steps.
std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, PassWork work,
                                      std::stop_token stop = {});

/// All samples of a tile in one pass.
std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, std::stop_token stop = {});

}  // namespace tessera
