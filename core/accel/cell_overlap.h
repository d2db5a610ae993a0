#pragma once

#include <cstdint>

#include "core/accel/items.h"

namespace tessera {

/// Whether any of the item may lie in the closed cell: never wrongly false. Exact for triangles but for a margin of
/// 2^-40 of the coordinates (separating axes, Akenine-Möller 2001), by the item's box for everything else.
bool touches(const Items& items, std::uint32_t item, const Aabb& cell);

}  // namespace tessera
