#include "core/accel/wide/joined_accel.h"

#include <utility>

namespace tessera {

JoinedAccel::JoinedAccel(Bodies bodies, const WideKernels& kernels, MakeTree make)
    : wide_(std::move(bodies), kernels, std::move(make)) {}

std::optional<Hit> JoinedAccel::closest(const Ray& ray, TraceLog log) const {
  return of_object(wide_.closest(of_body(ray), log));
}

bool JoinedAccel::occluded(const Ray& ray, TraceLog log) const { return wide_.occluded(of_body(ray), log); }

std::optional<Hit> JoinedAccel::closest_among(const Ray& ray, std::span<const std::uint32_t> objects,
                                              TraceLog log) const {
  return of_object(wide_.closest_among(of_body(ray), bodies().of_objects(objects), log));
}

std::optional<Hit> JoinedAccel::coincident(const Ray& ray, const Hit& hit, TraceLog log) const {
  const std::uint32_t next = hit.object + 1;
  if (next == bodies().scene().objects.size()) return std::nullopt;
  return of_object(wide_.closest_at(of_body(ray), hit.t, bodies().first_of(next), log));
}

void JoinedAccel::closest(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log, Candidates among) const {
  with_bodies(among, [&](Candidates some) { wide_.closest(of_bodies(rays), hits, log, some); });
  to_objects(hits);
}

void JoinedAccel::occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const {
  wide_.occluded(of_bodies(rays), hidden, log);
}

void JoinedAccel::closest_fan(const RayFan& fan, std::span<Hit> hits, TraceLog log, Candidates among) const {
  with_bodies(among, [&](Candidates some) { wide_.closest_fan(fan, hits, log, some); });
  to_objects(hits);
}

void JoinedAccel::occluded_fan(Vec3 apex, std::span<const Ray> rays, std::span<std::uint8_t> hidden,
                               TraceLog log) const {
  wide_.occluded_fan(apex, of_bodies(rays), hidden, log);
}

template <typename Trace>
void JoinedAccel::with_bodies(Candidates objects, Trace&& trace) const {
  if (!objects) return trace(std::nullopt);
  const std::vector<std::uint32_t> some = bodies().of_objects(*objects);
  trace(some);
}

Ray JoinedAccel::of_body(const Ray& ray) const {
  Ray of_body = ray;
  of_body.leaves = bodies().left(ray.leaves);
  return of_body;
}

std::vector<Ray> JoinedAccel::of_bodies(std::span<const Ray> rays) const {
  std::vector<Ray> all(rays.begin(), rays.end());
  for (Ray& ray : all) ray.leaves = bodies().left(ray.leaves);
  return all;
}

std::optional<Hit> JoinedAccel::of_object(std::optional<Hit> hit) const {
  if (hit) to_objects({&*hit, 1});
  return hit;
}

void JoinedAccel::to_objects(std::span<Hit> hits) const {
  Bodies::Member member{};  // neighbours often hit the same
  for (Hit& hit : hits) {
    if (hit.t == kInfinity) continue;
    if (hit.object != member.body || hit.primitive - member.first >= member.count)
      member = bodies().member_at({hit.object, hit.primitive});
    hit.object = member.object;
    hit.primitive = member.is_quad ? 0 : hit.primitive - member.first;
  }
}

}  // namespace tessera
