#include "core/accel/bound_tree.h"
#include "core/accel/make.h"
#include "core/accel/with_bound.h"

namespace tessera {

std::unique_ptr<const Accel> make_bvh(std::shared_ptr<const Scene> scene, const AccelOptions& options) {
  return make_with_bound<BoundTree>(std::move(scene), options);
}

}  // namespace tessera
