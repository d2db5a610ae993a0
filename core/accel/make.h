#pragma once

#include <memory>

#include "core/accel/accel.h"

namespace tessera {

// One maker for each row of `accel_table()`; each stands in a file of its own, with the index that it instantiates.
std::unique_ptr<const Accel> make_brute(std::shared_ptr<const Scene> scene, const AccelOptions& options);
std::unique_ptr<const Accel> make_bounds(std::shared_ptr<const Scene> scene, const AccelOptions& options);
std::unique_ptr<const Accel> make_bvh(std::shared_ptr<const Scene> scene, const AccelOptions& options);
std::unique_ptr<const Accel> make_grid(std::shared_ptr<const Scene> scene, const AccelOptions& options);
std::unique_ptr<const Accel> make_octree(std::shared_ptr<const Scene> scene, const AccelOptions& options);
std::unique_ptr<const Accel> make_kd(std::shared_ptr<const Scene> scene, const AccelOptions& options);
std::unique_ptr<const Accel> make_bsp(std::shared_ptr<const Scene> scene, const AccelOptions& options);
std::unique_ptr<const Accel> make_wide(std::shared_ptr<const Scene> scene, const AccelOptions& options);

}  // namespace tessera
