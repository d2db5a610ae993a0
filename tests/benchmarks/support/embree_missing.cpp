// Stands in for embree_peer.cpp where Embree isn't installed.
#include "tests/benchmarks/support/embree_peer.h"

namespace tessera::bench {

std::vector<EmbreeMode> embree_modes() { return {}; }
std::string embree_version() { return ""; }
std::unique_ptr<EmbreeBuild> prepare_embree(const TriangleMesh&, EmbreeScenes, int) { return nullptr; }
std::unique_ptr<EmbreeBuild> prepare_embree_instances(const TriangleMesh&, Placements, EmbreeScenes, int) {
  return nullptr;
}
std::unique_ptr<EmbreeRays> make_embree_rays(int, bool) { return nullptr; }

}  // namespace tessera::bench
