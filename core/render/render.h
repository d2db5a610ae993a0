#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>

#include "core/accel/accel.h"
#include "core/film/film.h"
#include "core/plan/plan.h"
#include "core/scene/scene.h"
#include "core/scene/settings.h"
#include "core/screen/camera_rays.h"

namespace tessera {

/// Rays traced, by kind, and first-level rays that were not.
struct RayCounts {
  std::uint64_t camera = 0;
  std::uint64_t camera_hits = 0;
  std::uint64_t reflection = 0;
  std::uint64_t refraction = 0;
  std::uint64_t shadow = 0;
  std::uint64_t camera_skipped = 0;  ///< Samples in tiles that nothing projects into.

  std::uint64_t traced() const { return camera + reflection + refraction + shadow; }
  RayCounts& operator+=(const RayCounts& other);
};

/// Everything that rendering a tile reads. Immutable; shared by all threads of a job.
struct RenderContext {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Accel> accel;
  Settings settings;
  Plan plan;
  CameraRays rays;
};

struct TileResult {
  Pixels pixels;
  RayCounts rays;
};

/// Renders tile `index` of the plan: a pure function of its arguments, safe to call from any thread. Nothing when
/// `stop` was requested before it was done (looked at once a row).
std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, std::stop_token stop = {});

}  // namespace tessera
