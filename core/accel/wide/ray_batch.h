#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/index.h"
#include "core/bounds/cull_bundle.h"

namespace tessera {

/// A batch of rays that is searched object by object. Of each object, the rays that may hit it are picked, by
/// neighbours, and taken to its own space; what is found is put back. An answer is a `Hit`, or 1 for a ray that is
/// hidden.
template <typename Answer>
class RayBatch {
 public:
  /// Precondition: all rays are traceable. `reach` and `placed` as for `cull_pad`.
  RayBatch(std::span<const Ray> rays, std::span<Answer> answers, const Aabb& reach, Transform::Error placed)
      : rays_(rays), answers_(answers), reach_(reach), placed_(placed) {
    bundles_.reserve((rays.size() + kBundle - 1) / kBundle);
    for (std::size_t first = 0; first < rays.size(); first += kBundle)
      bundles_.emplace_back(rays.subspan(first, bundle_size(first)), reach, placed);
  }

  /// Puts objects in the order in which the batch's middle ray meets their boxes.
  void sort(std::span<std::uint32_t> objects, std::span<const Aabb> boxes) {
    const CullRay middle(rays_[rays_.size() / 2], reach_, placed_);
    order_.clear();
    for (const std::uint32_t object : objects) order_.emplace_back(middle.clip(boxes[object]).lo, object);
    std::ranges::sort(order_);
    std::ranges::transform(order_, objects.begin(), [](const auto& entry) { return entry.second; });
  }

  /// Picks the rays that may hit what lies in `box` before what they have hit; false if there are none. With
  /// `only_traceable`, without those that the placement makes untraceable.
  template <typename Counter>
  bool pick(const Aabb& box, const std::optional<Transform>& placement, bool only_traceable, Counter tally) {
    picked_.clear();
    local_.clear();
    for (std::size_t first = 0; first < rays_.size(); first += kBundle) {
      const std::size_t size = bundle_size(first);
      const bool misses = bundles_[first / kBundle].misses(box, limit(answers_.subspan(first, size)));
      tally.volumes(size, misses ? 0 : size);
      if (misses) continue;
      for (std::size_t i = first; i < first + size; ++i) {
        if (is_settled(answers_[i])) continue;
        Ray ray = placement ? placement->to_local(rays_[i]) : rays_[i];
        if (placement && only_traceable && !is_traceable(ray)) continue;
        ray.t_max = std::min(ray.t_max, just_beyond(answers_[i]));
        picked_.push_back(static_cast<std::uint32_t>(i));
        local_.push_back(ray);
      }
    }
    found_.assign(picked_.size(), Answer());
    return !picked_.empty();
  }

  /// The picked rays in their object's space, ending where they can't find anything better; and room for their
  /// answers, without any yet.
  std::span<const Ray> rays() const { return local_; }
  std::span<Answer> answers() { return found_; }

  void put_back() {
    for (std::size_t i = 0; i < picked_.size(); ++i) better(answers_[picked_[i]], found_[i]);
  }

 private:
  static constexpr std::size_t kBundle = 16;

  std::size_t bundle_size(std::size_t first) const { return std::min(kBundle, rays_.size() - first); }

  /// The greatest t that any of some rays looks for.
  static float limit(std::span<const Hit> hits) {
    float most = 0;
    for (const Hit& hit : hits) most = std::max(most, hit.t);
    return most;
  }
  static float limit(std::span<const std::uint8_t> hidden) {
    return std::ranges::find(hidden, 0) == hidden.end() ? kStop : kInfinity;
  }

  /// The open end of what a ray still looks for: at the hit's own t, a lesser object's wins.
  static float just_beyond(const Hit& hit) { return std::nextafter(hit.t, kInfinity); }
  static float just_beyond(std::uint8_t) { return kInfinity; }

  /// Whether nothing can be found that would change the answer.
  static bool is_settled(const Hit&) { return false; }
  static bool is_settled(std::uint8_t hidden) { return hidden; }

  static void better(Hit& hit, const Hit& found) { hit = std::min(hit, found); }
  static void better(std::uint8_t& hidden, std::uint8_t found) { hidden |= found; }

  std::span<const Ray> rays_;
  std::span<Answer> answers_;
  Aabb reach_;
  Transform::Error placed_;
  std::vector<CullBundle> bundles_;
  std::vector<std::pair<float, std::uint32_t>> order_;
  // Of the object at hand.
  std::vector<std::uint32_t> picked_;
  std::vector<Ray> local_;
  std::vector<Answer> found_;
};

}  // namespace tessera
