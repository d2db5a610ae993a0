#include "core/accel/linear_index.h"
#include "core/accel/make.h"
#include "core/accel/two_level.h"

namespace tessera {

std::unique_ptr<const Accel> make_brute(std::shared_ptr<const Scene> scene, const AccelOptions& options) {
  return std::make_unique<const TwoLevel<LinearIndex>>(std::move(scene), options);
}

}  // namespace tessera
