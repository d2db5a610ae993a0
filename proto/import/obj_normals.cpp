#include "proto/import/obj_normals.h"

#include <algorithm>
#include <cstdint>

#include "core/math/unit_vec3.h"
#include "proto/import/polygon.h"

namespace tessera::proto {
namespace {

/// A position as one smoothing group sees it.
using Key = std::uint64_t;
Key key(std::uint32_t group, std::uint32_t position) { return Key{group} << 32 | position; }

bool has_normal(ObjCorner corner) { return corner.normal != ObjCorner::kNoNormal; }

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
    for (const Vec3d& sum : sums_) normals_.push_back(UnitVec3::normalize(sum).value_or(UnitVec3::z()));
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
        const Vec3d area = area_of(corners);
        if (!is_finite(to_float(area))) return;
        for (const ObjCorner corner : corners) {
          const std::size_t place = place_of(key(group, corner.position));
          if (place != keys_.size()) sums_[place] = sums_[place] + area;
        }
      });
    }
  }

  Vec3d area_of(std::span<const ObjCorner> corners) {
    face_.clear();
    for (const ObjCorner corner : corners) face_.push_back(corner.position);
    return area_vector(positions_, face_);
  }

  void assign(ObjFaces& mesh) {
    bool has_normals = false;
    for_each_face(mesh, steps_, [&](std::span<ObjCorner> corners, std::uint32_t group) {
      for (ObjCorner& corner : corners) {
        if (!has_normal(corner) && group != 0)
          corner.normal = first_smooth_ + static_cast<std::uint32_t>(place_of(key(group, corner.position)));
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
  std::vector<Key> keys_;            ///< Of corners that need a smooth normal, ascending.
  std::vector<Vec3d> sums_;          ///< Of the area vectors that meet there.
  std::uint32_t first_smooth_ = 0;   ///< Of the normals made of `sums_`, in `normals_`.
  std::vector<std::uint32_t> face_;  ///< Scratch.
};

}  // namespace

void complete_normals(std::span<ObjFaces* const> meshes, const std::vector<Vec3>& positions, std::vector<Vec3>& normals,
                      Steps& steps) {
  Smoothing(meshes, positions, normals, steps).complete();
}

}  // namespace tessera::proto
