#pragma once

#include "core/accel/accel.h"
#include "core/accel/wide/wide_accel.h"

namespace tessera {

/// A `WideAccel` over bodies that are joined from a scene's objects: rays go in, and hits come out, by objects.
class JoinedAccel final : public Accel {
 public:
  JoinedAccel(Bodies bodies, const WideKernels& kernels, MakeTree make);

  std::optional<Hit> closest(const Ray& ray, TraceLog log) const override;
  bool occluded(const Ray& ray, TraceLog log) const override;
  std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects, TraceLog log) const override;
  std::optional<Hit> coincident(const Ray& ray, const Hit& hit, TraceLog log) const override;
  void closest(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log, Candidates among) const override;
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const override;
  void closest_fan(const RayFan& fan, std::span<Hit> hits, TraceLog log, Candidates among) const override;
  void occluded_fan(Vec3 apex, std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const override;
  AccelStats stats() const override { return wide_.stats(); }

 private:
  const Bodies& bodies() const { return wide_.bodies_; }
  /// Calls `trace` with the bodies of these objects.
  template <typename Trace>
  void with_bodies(Candidates objects, Trace&& trace) const;
  Ray of_body(const Ray& ray) const;
  std::vector<Ray> of_bodies(std::span<const Ray> rays) const;
  std::optional<Hit> of_object(std::optional<Hit> hit) const;
  void to_objects(std::span<Hit> hits) const;

  WideAccel wide_;
};

}  // namespace tessera
