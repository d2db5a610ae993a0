#include "core/accel/make.h"
#include "core/accel/plane_tree.h"
#include "core/accel/two_level.h"

namespace tessera {

std::unique_ptr<const Accel> make_kd(std::shared_ptr<const Scene> scene, const AccelOptions& options) {
  return std::make_unique<const TwoLevel<PlaneTree<AxisPlane, build_kd>>>(std::move(scene), options);
}

}  // namespace tessera
