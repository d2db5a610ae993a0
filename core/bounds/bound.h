#pragma once

#include <concepts>

#include "core/bounds/aabb.h"
#include "core/bounds/outline.h"
#include "core/math/interval.h"
#include "core/math/ray.h"
#include "core/math/transform.h"

namespace tessera {

/// A kind of bounding volume, with whatever its volumes have in common (the normals of slabs, the face limit of hulls).
/// The laws, which tests/property/bounds_test.cpp holds against every kind:
///   - `fit(outline)` contains the outline. It may thin the outline to what decides the volumes of its supersets.
///     An empty outline gives a volume that no ray hits.
///   - `join(a, b)` contains what `a` and `b` contain, whatever lies in it.
///   - `clipper(ray, reach, placed).clip(v)` contains the t of every hit on a primitive inside `v`: it is padded like
///     `CullRay`, of whose contract `reach` and `placed` are part. A miss is an interval with lo > hi. An end that is
///     NaN is no bound.
///   - `cost(v)` is what a ray that meets v's surroundings pays: proportional to the chance of a hit (surface area).
template <typename B>
concept Bound = requires(const B bound, const typename B::Volume& v, Outline& outline, Vec3 p, const Ray& ray,
                         const Aabb& reach, Transform::Error placed, const typename B::Clipper& clipper) {
  { bound.fit(outline) } -> std::same_as<typename B::Volume>;
  { bound.join(v, v) } -> std::same_as<typename B::Volume>;
  { bound.contains(v, p) } -> std::same_as<bool>;
  { bound.cost(v) } -> std::same_as<double>;
  { bound.bytes(v) } -> std::same_as<std::size_t>;  // on the heap, beside sizeof(Volume)
  { bound.clipper(ray, reach, placed) } -> std::same_as<typename B::Clipper>;
  { clipper.clip(v) } -> std::same_as<Interval>;
};

}  // namespace tessera
