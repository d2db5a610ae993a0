#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/light/environment_table.h"
#include "core/math/vec2.h"
#include "core/sampling/warp.h"
#include "core/scene/scene.h"

namespace tessera {

/// What is infinitely far away: directional lights, suns, and the environment, for which the scene's background stands
/// where there is none. Each that may be above the horizon is picked with a share: half of it for all alike, half by
/// the irradiance of each. Suns and the environment are one light with one density: each direction brings the radiance
/// of all. Immutable, safe from any thread.
class InfiniteLights {
 public:
  explicit InfiniteLights(const Scene& scene);

  /// How many of them are not black.
  std::uint32_t size() const {
    return static_cast<std::uint32_t>(directional_.size() + suns_.size() + has_environment_);
  }

  /// Of the heap that they take.
  std::size_t bytes() const {
    return directional_.capacity() * sizeof(Directional) + suns_.capacity() * sizeof(Sun) + (map_ ? map_->bytes() : 0);
  }

  /// What may come from them all to a surface, by which they share picks.
  struct Sum {
    double irradiance = 0;  ///< W/m², as far as light samples bring it. 0 only where nothing comes.
    double count = 0;       ///< Of those that it comes from.
  };
  /// `normal` is unit where only light from its side counts, and zero otherwise; so it is for all that follow.
  Sum sum(Vec3 normal) const;

  struct Sample {
    Vec3 direction;
    Rgb radiance;  ///< Of a directional light its irradiance.
    double pdf;    ///< Of a directional light its share; > 0 and finite.
    bool is_delta;
  };
  /// `pick` in [0, 1), `u` in [0, 1)². `sum` is that for the normal, and its irradiance isn't 0.
  std::optional<Sample> sample(Vec3 normal, const Sum& sum, double pick, Vec2 u) const;

  struct Value {
    Rgb radiance;
    double pdf;  ///< Of `sample`, directional lights left out.
  };
  /// What comes from a direction (unit).
  Value look_up(Vec3 normal, const Sum& sum, Vec3 direction) const { return look_up(normal, sum, direction, nullptr); }

 private:
  struct Sun {
    Basis to_center;
    float one_minus_cos;  ///< Of its angular radius.
    double sine;          ///< Of it.
    Rgb radiance;
    double irradiance;  ///< On a surface that faces it.
    bool holds(Vec3 direction) const;
  };
  struct Directional {
    Vec3 direction;  ///< To it.
    Rgb irradiance;
  };

  void add(const DirectionalLight& light);
  void add(const SunLight& light);
  void add(const EnvironmentLight& light);
  /// `within` holds the direction even where rounding has it beside its edge.
  Value look_up(Vec3 normal, const Sum& sum, Vec3 direction, const Sun* within) const;
  Value environment(Vec3 normal, Vec3 direction) const;
  Vec3 sample_environment(Vec3 normal, Vec2 u) const;
  /// What comes from one of them, its count being that one's part in all.
  static Sum sum_of(const Directional& light, Vec3 normal);
  static Sum sum_of(const Sun& sun, Vec3 normal);

  std::vector<Directional> directional_;
  std::vector<Sun> suns_;
  bool has_environment_ = false;
  Rgb environment_radiance_;  ///< Scales the map, where there is one.
  std::shared_ptr<const EnvironmentTable> map_;
  std::array<float, 9> map_to_world_{};
  Sum environment_sum_;
};

}  // namespace tessera
