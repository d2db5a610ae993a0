#include "core/accel/box_tree.h"
#include "core/accel/linear_index.h"
#include "core/accel/make.h"
#include "core/accel/two_level.h"
namespace tessera {
#define STUB(name, Index)                                                                      \
  std::unique_ptr<const Accel> name(std::shared_ptr<const Scene> scene, const AccelOptions&) { \
    return std::make_unique<const TwoLevel<Index>>(std::move(scene));                          \
  }
STUB(make_brute, LinearIndex)
STUB(make_bounds, BoxTree)
STUB(make_bvh, BoxTree)
STUB(make_grid, BoxTree)
STUB(make_octree, BoxTree)
STUB(make_kd, BoxTree)
STUB(make_bsp, BoxTree)
}  // namespace tessera
