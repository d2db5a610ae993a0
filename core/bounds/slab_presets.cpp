#include "core/bounds/slab_presets.h"

namespace tessera {

std::vector<Vec3> slab_preset(int count) {
  std::vector<Vec3> normals{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  if (count == 7 || count == 13) normals.insert(normals.end(), {{1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}});
  if (count == 9 || count == 13)
    normals.insert(normals.end(), {{1, 1, 0}, {1, -1, 0}, {1, 0, 1}, {1, 0, -1}, {0, 1, 1}, {0, 1, -1}});
  return normals;
}

}  // namespace tessera
