#pragma once

#include <algorithm>

#include "core/integrator/integrator.h"

namespace tessera {

/// Follows none: all is black.
class NoLight : public Integrator {
 public:
  std::size_t batch_size() const override { return 4096; }
  void begin(std::span<const SampleId>, RaySpan, std::span<const Hit>, Output out) override {
    std::ranges::fill(out.radiance, Rgb());
  }
  bool go_on() override { return false; }
};

}  // namespace tessera
