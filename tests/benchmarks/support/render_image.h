#pragma once

#include <memory>

#include "core/render/render.h"

namespace tessera::bench {

/// Plan and structure of an image; the structure even where the plan needs none.
RenderContext prepare(std::shared_ptr<const Scene> scene, const Camera& camera, const Settings& settings);

struct RenderTime {
  double seconds = 0;
  RayCounts rays;
};

/// Renders every tile into a film, on threads that take tiles as they come. What `prepare` does isn't timed.
RenderTime render(const RenderContext& context, unsigned threads);

}  // namespace tessera::bench
