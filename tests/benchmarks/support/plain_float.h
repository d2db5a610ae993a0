#pragma once

#include <memory>
#include <vector>

#include "core/accel/accel.h"

namespace tessera::bench {

/// A contrast to measure errors against, no structure of ours: brute force over triangles as most renderers test them,
/// all in float (Möller & Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", JGT 1997). The epsilon that is
/// usual against small determinants is left out, since it would lose whole scenes of small triangles.
class PlainFloat final : public Accel {
 public:
  /// Null for a scene that holds anything but meshes and quads, or that places them.
  static std::unique_ptr<const Accel> make(const Scene& scene);

  std::optional<Hit> closest(const Ray& ray, TraceLog log = {}) const override;
  bool occluded(const Ray& ray, TraceLog log = {}) const override { return closest(ray, log).has_value(); }
  std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t>, TraceLog log = {}) const override {
    return closest(ray, log);
  }
  /// Nothing of that kind is measured.
  std::optional<Hit> coincident(const Ray&, const Hit&, TraceLog = {}) const override { return std::nullopt; }
  AccelStats stats() const override { return {triangles_.size() * sizeof(Triangle)}; }

 private:
  struct Triangle {
    Vec3 a, ab, ac;
    std::uint32_t object, primitive;
  };
  std::vector<Triangle> triangles_;
};

}  // namespace tessera::bench
