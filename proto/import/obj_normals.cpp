#include "proto/import/obj_normals.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <unordered_set>

#include "core/math/unit_vec3.h"
#include "proto/import/polygon.h"

namespace tessera::proto {
namespace {

/// A position as one smoothing group sees it.
using Key = std::uint64_t;
Key key(std::uint32_t group, std::uint32_t position) { return Key{group} << 32 | position; }

bool has_normal(ObjCorner corner) { return corner.normal != ObjCorner::kNone; }

/// Calls `visit(corners, smoothing_group)` for every face.
template <typename Visit>
void for_each_face(ObjFaces& mesh, Steps& steps, const Visit& visit) {
  ObjCorner* next = mesh.corners.data();
  for (std::size_t i = 0; i < mesh.sizes.size(); ++i) {
    steps.take(mesh.sizes[i]);
    visit(std::span(next, mesh.sizes[i]), mesh.smoothing_groups[i]);
    next += mesh.sizes[i];
  }
}

class Smoothing {
 public:
  Smoothing(std::span<ObjFaces* const> meshes, const std::vector<Vec3>& positions, std::vector<Vec3>& normals,
            Steps& steps)
      : meshes_(meshes), positions_(positions), normals_(normals), steps_(steps) {}

  void complete() {
    find_keys();
    add_faces();
    first_smooth_ = static_cast<std::uint32_t>(normals_.size());
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      // Where faces on both sides of a card meet, what is left of their sum is rounding.
      const bool has_direction = length(sums_[i]) > 1e-6 * angles_[i];
      if (!has_direction) keys_without_normal_.insert(keys_[i]);
      normals_.push_back(has_direction ? UnitVec3::normalize(sums_[i]).value_or(UnitVec3::z()) : UnitVec3::z());
    }
    for (ObjFaces* mesh : meshes_) assign(*mesh);
  }

 private:
  void find_keys() {
    for (ObjFaces* mesh : meshes_) {
      for_each_face(*mesh, steps_, [&](std::span<const ObjCorner> corners, std::uint32_t group) {
        if (group == 0) return;
        for (const ObjCorner corner : corners) {
          if (!has_normal(corner)) keys_.push_back(key(group, corner.position));
        }
      });
    }
    std::sort(keys_.begin(), keys_.end(), [&](Key a, Key b) {
      steps_.take();
      return a < b;
    });
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    sums_.resize(keys_.size());
    angles_.resize(keys_.size());
  }

  /// The key's place in `keys_`; their number when it isn't there.
  std::size_t place_of(Key key) const {
    const auto found = std::lower_bound(keys_.begin(), keys_.end(), key);
    const bool is_there = found != keys_.end() && *found == key;
    return static_cast<std::size_t>((is_there ? found : keys_.end()) - keys_.begin());
  }

  void add_faces() {
    if (keys_.empty()) return;
    for (ObjFaces* mesh : meshes_) {
      for_each_face(*mesh, steps_, [&](std::span<const ObjCorner> corners, std::uint32_t group) {
        if (group == 0) return;
        const std::optional<UnitVec3> normal = UnitVec3::normalize(area_of(corners));
        if (!normal) return;
        for (std::size_t i = 0; i < corners.size(); ++i) {
          const std::size_t place = place_of(key(group, corners[i].position));
          if (place == keys_.size()) continue;
          const double angle = angle_at(corners, i);
          sums_[place] = sums_[place] + to_double(*normal) * angle;
          angles_[place] += angle;
        }
      });
    }
  }

  Vec3d area_of(std::span<const ObjCorner> corners) {
    face_.clear();
    for (const ObjCorner corner : corners) face_.push_back(corner.position);
    return area_vector(positions_, face_);
  }

  /// Between the sides that meet in a corner.
  double angle_at(std::span<const ObjCorner> corners, std::size_t i) const {
    const auto at = [&](std::size_t corner) {
      return to_double(positions_[corners[corner % corners.size()].position]);
    };
    return angle_between(at(i + 1) - at(i), at(i + corners.size() - 1) - at(i));
  }

  void assign(ObjFaces& mesh) {
    bool has_normals = false;
    for_each_face(mesh, steps_, [&](std::span<ObjCorner> corners, std::uint32_t group) {
      for (ObjCorner& corner : corners) {
        const Key place = key(group, corner.position);
        if (!has_normal(corner) && group != 0 && !keys_without_normal_.contains(place))
          corner.normal = first_smooth_ + static_cast<std::uint32_t>(place_of(place));
        has_normals |= has_normal(corner);
      }
    });
    if (!has_normals) return;
    for_each_face(mesh, steps_, [&](std::span<ObjCorner> corners, std::uint32_t) {
      if (std::ranges::all_of(corners, has_normal)) return;
      const auto flat = static_cast<std::uint32_t>(normals_.size());
      normals_.push_back(UnitVec3::normalize(area_of(corners)).value_or(UnitVec3::z()));
      for (ObjCorner& corner : corners) {
        if (!has_normal(corner)) corner.normal = flat;
      }
    });
  }

  std::span<ObjFaces* const> meshes_;
  const std::vector<Vec3>& positions_;
  std::vector<Vec3>& normals_;
  Steps& steps_;
  std::vector<Key> keys_;       ///< Of corners that need a smooth normal, ascending.
  std::vector<Vec3d> sums_;     ///< Of the faces' normals that meet there, by their angles,
  std::vector<double> angles_;  ///< and of these.
  std::unordered_set<Key> keys_without_normal_;
  std::uint32_t first_smooth_ = 0;   ///< Of the normals made of `sums_`, in `normals_`.
  std::vector<std::uint32_t> face_;  ///< Scratch.
};

}  // namespace

void complete_normals(std::span<ObjFaces* const> meshes, const std::vector<Vec3>& positions, std::vector<Vec3>& normals,
                      Steps& steps) {
  Smoothing(meshes, positions, normals, steps).complete();
}

}  // namespace tessera::proto
