#include "tests/benchmarks/support/embree_peer.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <stdexcept>
#include <type_traits>

#include <embree3/rtcore.h>

#include "tests/support/flush_to_zero.h"

namespace tessera::bench {
namespace {

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release>;
using SceneHandle = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;

bool add_bytes(void* sum, ssize_t bytes, bool) {
  *static_cast<std::atomic<std::ptrdiff_t>*>(sum) += bytes;
  return true;
}

class Built final : public EmbreeScene {
 public:
  Built(const TriangleMesh& mesh, EmbreeScenes scenes, int threads)
      : positions_(mesh.positions), device_(rtcNewDevice(("threads=" + std::to_string(threads)).c_str())) {
    if (!device_) throw std::runtime_error("Embree makes no device");
    rtcSetDeviceErrorFunction(
        device_.get(), [](void*, RTCError, const char* text) { throw std::runtime_error(text); }, nullptr);
    rtcSetDeviceMemoryMonitorFunction(device_.get(), add_bytes, &bytes_);
    positions_.emplace_back();  // Embree reads 16 bytes at the last position too
    scene_ = new_scene(scenes);
    const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    if (scenes == EmbreeScenes::high) rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions_.data(), 0,
                               sizeof(Vec3), mesh.positions.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                               sizeof(TriangleIndices), mesh.triangles.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
  }

  /// The mesh becomes a scene of its own, which is built at once; what is left is one of its instances.
  void instance(Placements placements, EmbreeScenes scenes) {
    rtcCommitScene(scene_.get());
    mesh_ = std::move(scene_);
    scene_ = new_scene(scenes);
    for (const auto& rows : placements) {
      const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(geometry, mesh_.get());
      rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, rows.data());
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(scene_.get(), geometry);
      rtcReleaseGeometry(geometry);
    }
  }

  void commit() { rtcCommitScene(scene_.get()); }
  RTCScene handle() const { return scene_.get(); }
  std::size_t bytes() const override { return static_cast<std::size_t>(bytes_.load()); }
  bool has_instances() const override { return mesh_ != nullptr; }

 private:
  SceneHandle new_scene(EmbreeScenes scenes) const {
    SceneHandle scene(rtcNewScene(device_.get()));
    if (scenes == EmbreeScenes::robust) rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    if (scenes == EmbreeScenes::compact) rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_COMPACT);
    if (scenes == EmbreeScenes::high) rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_HIGH);
    return scene;
  }

  std::atomic<std::ptrdiff_t> bytes_{0};  // outlives the device that adds to it
  std::vector<Vec3> positions_;
  Device device_;
  SceneHandle mesh_;  ///< That `scene_` has instances of.
  SceneHandle scene_;
};

class Build final : public EmbreeBuild {
 public:
  explicit Build(std::unique_ptr<Built> scene) : scene_(std::move(scene)) {}
  std::unique_ptr<EmbreeScene> build() override {
    scene_->commit();
    return std::move(scene_);
  }

 private:
  std::unique_ptr<Built> scene_;
};

// Embree's calls and types for a packet of so many rays.
template <int kWidth>
struct Calls;
template <>
struct Calls<1> {
  using RayPacket = RTCRay;
  using RayHitPacket = RTCRayHit;
  static void intersect(const int*, RTCScene s, RTCIntersectContext* c, RTCRayHit* r) { rtcIntersect1(s, c, r); }
  static void occluded(const int*, RTCScene s, RTCIntersectContext* c, RTCRay* r) { rtcOccluded1(s, c, r); }
};
template <>
struct Calls<8> {
  using RayPacket = RTCRay8;
  using RayHitPacket = RTCRayHit8;
  static constexpr auto intersect = rtcIntersect8;
  static constexpr auto occluded = rtcOccluded8;
};
template <>
struct Calls<16> {
  using RayPacket = RTCRay16;
  using RayHitPacket = RTCRayHit16;
  static constexpr auto intersect = rtcIntersect16;
  static constexpr auto occluded = rtcOccluded16;
};

// A lane of a packet's field; a single ray's fields are their own lane.
template <typename T>
T& lane(T& field, std::size_t) {
  return field;
}
template <typename T, std::size_t n>
T& lane(T (&field)[n], std::size_t i) {
  return field[i];
}

template <int kWidth, bool kAnyHit>
class Packets final : public EmbreeRays {
 public:
  void pack(std::span<const Ray> rays) override {
    count_ = rays.size();
    packets_.resize((count_ + kWidth - 1) / kWidth);
    for (std::size_t i = 0; i < packets_.size() * kWidth; ++i) put(rays[std::min(i, count_ - 1)], i);
  }

  void trace(const EmbreeScene& scene, bool coherent) override {
    const FlushToZero flush;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    alignas(64) int valid[kWidth];
    std::fill_n(valid, kWidth, -1);
    const RTCScene handle = static_cast<const Built&>(scene).handle();
    // What fills the last packet up is traced, too: a few rays among many.
    for (Packet& packet : packets_)
      if constexpr (kAnyHit)
        Calls<kWidth>::occluded(valid, handle, &context, &packet);
      else
        Calls<kWidth>::intersect(valid, handle, &context, &packet);
  }

  void answers(std::span<float> t) const override {
    for (std::size_t i = 0; i < count_; ++i) {
      const Packet& packet = packets_[i / kWidth];
      if constexpr (kAnyHit)
        t[i] = lane(packet.tfar, i % kWidth) < 0 ? 0 : kInfinity;
      else
        t[i] = lane(packet.hit.geomID, i % kWidth) == RTC_INVALID_GEOMETRY_ID ? kInfinity
                                                                              : lane(packet.ray.tfar, i % kWidth);
    }
  }

 private:
  using Packet = std::conditional_t<kAnyHit, typename Calls<kWidth>::RayPacket, typename Calls<kWidth>::RayHitPacket>;

  void put(const Ray& from, std::size_t i) {
    Packet& packet = packets_[i / kWidth];
    const std::size_t l = i % kWidth;
    if constexpr (kAnyHit) {
      put(from, packet, l);
    } else {
      put(from, packet.ray, l);
      lane(packet.hit.geomID, l) = RTC_INVALID_GEOMETRY_ID;
      lane(packet.hit.primID, l) = RTC_INVALID_GEOMETRY_ID;
      lane(packet.hit.instID[0], l) = RTC_INVALID_GEOMETRY_ID;
    }
  }
  static void put(const Ray& from, typename Calls<kWidth>::RayPacket& to, std::size_t l) {
    lane(to.org_x, l) = from.origin.x;
    lane(to.org_y, l) = from.origin.y;
    lane(to.org_z, l) = from.origin.z;
    lane(to.dir_x, l) = from.direction.x;
    lane(to.dir_y, l) = from.direction.y;
    lane(to.dir_z, l) = from.direction.z;
    lane(to.tnear, l) = from.t_min;
    lane(to.tfar, l) = from.t_max;
    lane(to.time, l) = 0;
    lane(to.mask, l) = std::numeric_limits<unsigned>::max();
    lane(to.id, l) = 0;
    lane(to.flags, l) = 0;
  }

  std::size_t count_ = 0;
  std::vector<Packet> packets_;
};

template <bool kAnyHit>
std::unique_ptr<EmbreeRays> make_packets(int width) {
  if (width == 1) return std::make_unique<Packets<1, kAnyHit>>();
  if (width == 8) return std::make_unique<Packets<8, kAnyHit>>();
  return std::make_unique<Packets<16, kAnyHit>>();
}

}  // namespace

std::vector<EmbreeMode> embree_modes() {
  std::vector<EmbreeMode> modes;
  for (const EmbreeScenes scenes : kEmbreeScenes) {
    modes.push_back({scenes, 1, false});
    for (const int width : {8, 16})
      for (const bool coherent : {false, true}) modes.push_back({scenes, width, coherent});
  }
  return modes;
}

std::string embree_version() { return "Embree " RTC_VERSION_STRING; }

std::unique_ptr<EmbreeBuild> prepare_embree(const TriangleMesh& mesh, EmbreeScenes scenes, int threads) {
  return std::make_unique<Build>(std::make_unique<Built>(mesh, scenes, threads));
}

std::unique_ptr<EmbreeBuild> prepare_embree_instances(const TriangleMesh& mesh, Placements placements,
                                                      EmbreeScenes scenes, int threads) {
  auto built = std::make_unique<Built>(mesh, scenes, threads);
  built->instance(placements, scenes);
  return std::make_unique<Build>(std::move(built));
}

std::unique_ptr<EmbreeRays> make_embree_rays(int width, bool is_any_hit) {
  return is_any_hit ? make_packets<true>(width) : make_packets<false>(width);
}

}  // namespace tessera::bench
