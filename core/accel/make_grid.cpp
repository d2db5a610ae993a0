#include "core/accel/grid.h"
#include "core/accel/make.h"
#include "core/accel/two_level.h"

namespace tessera {

std::unique_ptr<const Accel> make_grid(std::shared_ptr<const Scene> scene, const AccelOptions& options) {
  return std::make_unique<const TwoLevel<Grid>>(std::move(scene), options);
}

}  // namespace tessera
