#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/accel/accel.h"
#include "core/bounds/cull_bundle.h"

namespace tessera {

/// A batch of rays that is searched object by object. Of each object the rays that may hit it are picked, by
/// neighbours, and taken to its own space; what is found is put back. An answer is a `Hit`, or 1 for a ray that is
/// hidden. Memory is kept from batch to batch.
template <typename Answer>
class RayBatch {
 public:
  /// `reach` and `placed` as for `cull_pad`.
  RayBatch(const Aabb& reach, Transform::Error placed) : reach_(reach), placed_(placed) {}

  /// Begins with rays that have no answers yet. Precondition: all are traceable, and there are some. Neighbours that
  /// run together are picked together, others one by one.
  void start(std::span<const Ray> rays, std::span<Answer> answers, bool run_together) {
    rays_ = rays;
    answers_ = answers;
    run_together_ = run_together;
    cull_rays_.clear();
    bundles_.clear();
    for (std::size_t first = 0; first < rays.size(); first += kBundle)
      bundles_.emplace_back(rays.subspan(first, bundle_size(first)), reach_, placed_);
  }

  /// Objects in the order in which the batch's middle ray meets their boxes.
  std::span<const std::uint32_t> near_to_far(std::span<const std::uint32_t> objects, std::span<const Aabb> boxes) {
    const CullRay middle(rays_[rays_.size() / 2], reach_, placed_);
    by_entry_.clear();
    for (const std::uint32_t object : objects) by_entry_.emplace_back(middle.clip(boxes[object]).lo, object);
    std::ranges::sort(by_entry_);
    order_.clear();
    for (const auto& [entry, object] : by_entry_) order_.push_back(object);
    return order_;
  }

  /// Picks the rays that may hit what lies in `box` before what they have hit; false if there are none. Of a mesh
  /// without those that the placement makes untraceable; one without a placement looks at each ray by itself.
  template <typename Counter>
  bool pick(const Aabb& box, const Transform* placement, bool is_mesh, Counter tally) {
    const bool one_by_one = !run_together_ && (placement || !is_mesh);
    entered_.clear();
    for (std::size_t first = 0; first < rays_.size(); first += kBundle) {
      const std::size_t size = bundle_size(first);
      const bool misses = bundles_[first / kBundle].misses(box, limit(answers_.subspan(first, size)));
      if (misses || !one_by_one) tally.volumes(size, misses ? 0 : size);
      if (!misses) entered_.push_back(first);
    }
    is_whole_ = !placement && !one_by_one && entered_.size() == bundles_.size();
    if (is_whole_) return true;
    picked_.clear();
    local_.clear();
    found_.clear();
    if (one_by_one && cull_rays_.empty())
      for (const Ray& ray : rays_) cull_rays_.emplace_back(ray, reach_, placed_);
    for (const std::size_t first : entered_) pick_from(first, one_by_one ? &box : nullptr, placement, is_mesh, tally);
    return !picked_.empty();
  }

  /// All rays, in the world's space.
  std::span<const Ray> world_rays() const { return rays_; }

  /// Whether all rays are picked as they are.
  bool is_whole() const { return is_whole_; }

  /// The picked rays in their object's space.
  std::span<const Ray> rays() const { return is_whole_ ? rays_ : local_; }

  /// Their answers so far, to be bettered.
  std::span<Answer> found() { return is_whole_ ? answers_ : found_; }

  void put_back() {
    if (is_whole_) return;
    for (std::size_t i = 0; i < picked_.size(); ++i) answers_[picked_[i]] = found_[i];
  }

 private:
  static constexpr std::size_t kBundle = 16;

  std::size_t bundle_size(std::size_t first) const { return std::min(kBundle, rays_.size() - first); }

  template <typename Counter>
  void pick_from(std::size_t first, const Aabb* box, const Transform* placement, bool only_traceable, Counter tally) {
    for (std::size_t i = first; i < first + bundle_size(first); ++i) {
      if (is_settled(answers_[i])) continue;
      if (box) {
        const bool misses = cull_rays_[i].misses(*box, rays_[i].t_min, std::min(rays_[i].t_max, limit(answers_[i])));
        tally.volumes(1, misses ? 0 : 1);
        if (misses) continue;
      }
      const Ray ray = placement ? placement->to_local(rays_[i]) : rays_[i];
      if (placement && only_traceable && !is_traceable(ray)) continue;
      found_.push_back(answers_[i]);
      picked_.push_back(static_cast<std::uint32_t>(i));
      local_.push_back(ray);
    }
  }

  static float limit(const Hit& hit) { return hit.t; }
  static float limit(std::uint8_t) { return kInfinity; }

  /// The greatest t that any of some rays looks for.
  static float limit(std::span<const Hit> hits) {
    float most = 0;
    for (const Hit& hit : hits) most = std::max(most, hit.t);
    return most;
  }
  static float limit(std::span<const std::uint8_t> hidden) {
    return std::ranges::find(hidden, 0) == hidden.end() ? -kInfinity : kInfinity;
  }

  /// Whether nothing can be found that would change the answer.
  static bool is_settled(const Hit&) { return false; }
  static bool is_settled(std::uint8_t hidden) { return hidden; }

  Aabb reach_;
  Transform::Error placed_;
  std::span<const Ray> rays_;
  std::span<Answer> answers_;
  bool run_together_ = true;
  std::vector<CullBundle> bundles_;
  std::vector<CullRay> cull_rays_;  ///< For each ray, once any is picked alone.
  std::vector<std::pair<float, std::uint32_t>> by_entry_;
  std::vector<std::uint32_t> order_;
  // Of the object at hand.
  bool is_whole_ = false;             ///< All rays are picked as they are: nothing is copied.
  std::vector<std::size_t> entered_;  ///< Bundles' first rays.
  std::vector<std::uint32_t> picked_;
  std::vector<Ray> local_;
  std::vector<Answer> found_;
};

}  // namespace tessera
