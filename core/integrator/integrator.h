#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/accel/accel.h"
#include "core/math/ray_fan.h"
#include "core/math/rgb.h"
#include "core/sampling/sampler.h"

namespace tessera {

/// Follows light along camera rays, many together. What a ray brings doesn't depend on which others are in its batch,
/// nor on where it is interrupted. For one thread at a time: memory is kept from batch to batch.
class Integrator {
 public:
  virtual ~Integrator() = default;

  /// How many camera rays had better be followed together.
  virtual std::size_t batch_size() const = 0;

  /// What camera rays bring; both of their number, and valid until all is traced.
  struct Output {
    std::span<Rgb> radiance;  ///< That arrives along each, W/(sr m²).
    /// 1 for rays that hit something; those whose way leads through surfaces that aren't there (`Material::alpha`) and
    /// then into the background are set to 0.
    std::span<std::uint8_t> covered;
  };

  /// Begins with a batch of camera rays, each of a sample, given what each hits; `t` is infinite where that is nothing.
  /// Spans are of one length; `hits` stays valid until all is traced.
  virtual void begin(std::span<const SampleId> samples, RaySpan rays, std::span<const Hit> hits, Output out) = 0;

  /// Goes on by one kind of ray of one batch: as many rays as `begin` was given, or twice that, at most. False when
  /// nothing is left to be done; then `out` is complete.
  virtual bool go_on() = 0;
};

}  // namespace tessera
