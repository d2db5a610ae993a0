#include "core/accel/bound_list.h"
#include "core/accel/make.h"
#include "core/accel/with_bound.h"

namespace tessera {

std::unique_ptr<const Accel> make_bounds(std::shared_ptr<const Scene> scene, const AccelOptions& options) {
  return make_with_bound<BoundList>(std::move(scene), options);
}

}  // namespace tessera
