#pragma once

#include <memory>
#include <utility>

#include "core/accel/two_level.h"
#include "core/bounds/box_bound.h"
#include "core/bounds/hull_bound.h"
#include "core/bounds/slab_bound.h"
#include "core/bounds/sphere_bound.h"

namespace tessera {

/// The structure over the bound that the options name; `Index<B>` is its index.
template <template <typename> typename Index>
std::unique_ptr<const Accel> make_with_bound(std::shared_ptr<const Scene> scene, const AccelOptions& options) {
  const auto make = [&]<typename B>(const B& bound) -> std::unique_ptr<const Accel> {
    return std::make_unique<const TwoLevel<Index<B>>>(std::move(scene), options, bound);
  };
  switch (options.bound) {
    case BoundKind::sphere:
      return make(SphereBound());
    case BoundKind::slabs:
      return make(SlabBound(options.normals));
    case BoundKind::hull:
      return make(HullBound{options.max_faces});
    default:
      return make(BoxBound());
  }
}

}  // namespace tessera
