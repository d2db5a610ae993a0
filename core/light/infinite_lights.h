#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/light/environment_table.h"
#include "core/math/vec2.h"
#include "core/sampling/warp.h"
#include "core/scene/scene.h"

namespace tessera {

/// What is infinitely far away: directional lights, suns, and the environment, for which the scene's background stands
/// where there is none. Each is picked with a share that is the same everywhere: half of it for all alike, half by what
/// they send. Suns and the environment are one light with one density: each direction brings the radiance of all.
/// Immutable, safe from any thread.
class InfiniteLights {
 public:
  explicit InfiniteLights(const Scene& scene);

  /// How many of them are not black.
  std::uint32_t size() const {
    return static_cast<std::uint32_t>(directional_.size() + suns_.size() + has_environment_);
  }

  /// Of the heap that they take.
  std::size_t bytes() const { return map_ ? map_->bytes() : 0; }

  struct Sample {
    Vec3 direction;
    Rgb radiance;  ///< Of a directional light its irradiance.
    double pdf;    ///< Of a directional light its share; > 0 and finite.
    bool is_delta;
  };
  /// `pick` in [0, 1), `u` in [0, 1)². `normal` is unit where only light from its side counts, and zero otherwise.
  /// Precondition: there are lights.
  std::optional<Sample> sample(Vec3 normal, double pick, Vec2 u) const;

  struct Value {
    Rgb radiance;
    double pdf;  ///< Of `sample`, directional lights left out.
  };
  /// What comes from a direction (unit).
  Value look_up(Vec3 normal, Vec3 direction) const { return look_up(normal, direction, nullptr); }

 private:
  struct Sun {
    Basis to_center;
    float one_minus_cos;  ///< Of its angular radius.
    Rgb radiance;
    double share;
    bool holds(Vec3 direction) const;
  };
  struct Directional {
    Vec3 direction;  ///< To it.
    Rgb irradiance;
    double share;
  };

  void add(const DirectionalLight& light);
  void add(const SunLight& light);
  void add(const EnvironmentLight& light);
  /// `within` holds the direction even where rounding has it beside its edge.
  Value look_up(Vec3 normal, Vec3 direction, const Sun* within) const;
  Value environment(Vec3 normal, Vec3 direction) const;
  Vec3 sample_environment(Vec3 normal, Vec2 u) const;

  std::vector<Directional> directional_;
  std::vector<Sun> suns_;
  bool has_environment_ = false;
  Rgb environment_radiance_;  ///< Scales the map, where there is one.
  std::optional<EnvironmentTable> map_;
  std::array<float, 9> map_to_world_{};
  double environment_share_ = 0;
};

}  // namespace tessera
