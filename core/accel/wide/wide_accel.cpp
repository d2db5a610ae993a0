#include "core/accel/wide/wide_accel.h"

#include <algorithm>
#include <numeric>
#include <type_traits>

#include "core/accel/index.h"
#include "core/accel/make.h"
#include "core/accel/tally.h"
#include "core/accel/wide/cache_lines.h"
#include "core/accel/wide/cube_sides.h"
#include "core/accel/wide/joined_accel.h"
#include "core/accel/wide/wide_build.h"
#include "core/bounds/way_to_point.h"

namespace tessera {
namespace {

/// A ball around what a shape is, in its own space.
struct Ball {
  Vec3d center;
  double radius = kInfinity;
};
Ball ball_around(const Shape& shape, const Aabb& box) {
  if (const auto* sphere = std::get_if<Sphere>(&shape)) return {to_double(sphere->center), sphere->radius};
  const auto* mesh = std::get_if<TriangleMesh>(&shape);
  if (!mesh || box.empty()) return {};
  Ball ball{to_double(box.center()), 0};
  for (const Vec3 p : mesh->positions)
    if (box.contains(p)) ball.radius = std::max(ball.radius, length(to_double(p) - ball.center));
  return ball;
}

/// The boxes of all objects: in the world that of their own box and that of the ball both hold what is placed, and
/// which one is smaller depends on how it is turned.
std::vector<Aabb> boxes_of(const Scene& scene) {
  std::vector<Aabb> boxes = world_bounds(scene);
  std::vector<std::optional<Ball>> balls(scene.shapes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Object& object = scene.objects[i];
    if (!object.placement || boxes[i].empty()) continue;
    std::optional<Ball>& ball = balls[object.shape];
    if (!ball) ball = ball_around(scene.shapes[object.shape], local_bounds(scene)[object.shape]);
    if (ball->radius == kInfinity) continue;
    const Transform::ToWorld to_world = object.placement->to_world();
    const Vec3d center = to_world.point(ball->center);
    Vec3d reach;
    for (int axis = 0; axis < 3; ++axis) {
      const double* row = to_world.rows().data() + std::ptrdiff_t{4} * axis;
      const double size = max_component(abs(ball->center));  // whose rounding is covered too
      reach[axis] = ball->radius * length(Vec3d{row[0], row[1], row[2]}) * (1 + 0x1p-40) +
                    0x1p-48 * ((std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2])) * size + std::abs(row[3]));
    }
    const Aabb around = outward(center - reach, center + reach);
    boxes[i].lo = max(boxes[i].lo, around.lo);
    boxes[i].hi = min(boxes[i].hi, around.hi);
  }
  return boxes;
}

/// Runs `trace` with a tally that counts, or with one that costs nothing.
template <typename Trace>
auto counted(TraceLog log, Trace&& trace) {
  return log.counts ? trace(Tally(*log.counts)) : trace(NoTally());
}

/// Asks for the rays ahead besides, which machines do by themselves only up to the end of a page (4 KiB): incoherent
/// rays of an interior took 2 to 3% less.
bool all_traceable(std::span<const Ray> rays) {
  constexpr std::size_t kLinesAhead = 80;
  return std::ranges::all_of(rays, [](const Ray& ray) {
    prefetch_lines(&ray, 1, kLinesAhead);
    return is_traceable(ray);
  });
}

/// Asks for what a fan reads and writes one after the other, or for the beginning of it: first-level rays took 3 to 4%
/// less where nobody had it in a cache.
HWY_INLINE void prefetch(const RayFan& fan, std::span<const Hit> hits) {
  constexpr std::size_t kInLine = kCacheLine / sizeof(float);
  const std::size_t count = std::min(kFanRays, fan.size()), lines = count / kInLine + 1;
  prefetch_lines(hits.data(), lines * sizeof(Hit) / sizeof(float));
  for (const float* part : {fan.x.data(), fan.y.data(), fan.z.data()}) prefetch_lines(part, lines);
}

/// Bodies that fans, and that other batches, go through one by one; of more, each ray looks for its own in the
/// hierarchy over them. Neighbours in a fan enter the same boxes, those of other batches may not: with 65 meshes, one
/// by one, a render's fans took 12% less, mirrored rays three times as long; with ten rough mirrors, one by one, 20%
/// longer.
constexpr std::size_t kFewForFans = 65, kFewForOthers = 8;

/// Large batches have enough rays for each of more bodies: a stream is worth it.
constexpr std::size_t kRaysForEach = 128;

/// Bodies up to which each is asked whether it lies on the way of all of a batch's shadow rays. Tried with a thousand;
/// what this costs grows with their number, and of many more it would be more than what it saves.
constexpr std::size_t kFewToAsk = 4096;

/// Rays that are worth a kernel's setting up for many at once. On a Sapphire Rapids, in a mesh of 100k triangles, those
/// of a diffuse bounce took 304 ns one by one; by 16, 64, 256 and 1024 together 425, 234, 144 and 116 ns each. Rays of
/// all directions took 485, and 662, 482, 385 and 421.
constexpr std::size_t kLeastStream = 64;

/// Rays of a fan that are worth a picture of their own for a body among many.
constexpr std::size_t kLeastFan = 32;

}  // namespace

WideAccel::WideAccel(std::shared_ptr<const Scene> scene, const AccelOptions&, const WideKernels& kernels, MakeTree make)
    : WideAccel(Bodies::apart(std::move(scene)), kernels, std::move(make)) {}

WideAccel::WideAccel(Bodies bodies, const WideKernels& kernels, MakeTree make)
    : bodies_(std::move(bodies)),
      kernels_(kernels),
      boxes_(bodies_.around(boxes_of(bodies_.scene()))),
      tree_(build_wide_over(boxes_)),
      make_(std::move(make)),
      meshes_(bodies_.hierarchies()) {
  for (const Object& object : bodies_.scene().objects)
    if (object.placement) {
      const Transform::Error e = object.placement->error();
      placed_ = {std::max(placed_.condition, e.condition), std::max(placed_.offset, e.offset)};
    }
  if (boxes_.size() <= kFewToAsk) {
    all_.resize(boxes_.size());
    std::iota(all_.begin(), all_.end(), 0);
  }
  // What rays are sure to come to is better made by whoever waits for the structure.
  if (is_lone_mesh()) mesh_tree(bodies_[0]);
}

MadeTree WideAccel::build_tree(const TriangleMesh& mesh) { return {build_wide(mesh)}; }

bool WideAccel::pass_by(std::uint32_t body, std::span<const Ray> rays) const {
  const Bodies::Body& b = bodies_[body];
  return Bodies::is_mesh(b) && !meshes_[b.hierarchy].ready() && std::ranges::all_of(rays, [&](const Ray& ray) {
           return CullRay(ray, tree_.root, placed_).misses(boxes_[body], ray.t_min, ray.t_max);
         });
}

void WideAccel::closest_in(std::uint32_t body, const Ray& world, Hit& best, TraceLog log, std::uint32_t least) const {
  if (pass_by(body, {&world, 1})) return;
  const Bodies::Body& b = bodies_[body];
  const Ray ray = b.placement ? b.placement->to_local(world) : world;
  if (log.tested) bodies_.mark(*log.tested, body);
  if (Bodies::is_mesh(b)) {
    if (!is_traceable(ray)) return;  // a transform may have flattened the direction to zero
    if (least == 0) return kernels_.closest(mesh_tree(b), body, {&ray, 1}, {&best, 1}, log.counts);
    kernels_.closest_from(mesh_tree(b), {body, least}, ray, best, log.counts);
  } else {
    const std::optional<float> t = intersect_single(*b.shape, ray);
    if (log.counts) Tally(*log.counts).object(t.has_value());
    if (t) best = std::min(best, Hit{*t, body, 0});
  }
}

bool WideAccel::occluded_by(std::uint32_t body, const Ray& world, TraceLog log) const {
  if (pass_by(body, {&world, 1})) return false;
  const Bodies::Body& b = bodies_[body];
  const Ray ray = b.placement ? b.placement->to_local(world) : world;
  if (log.tested) bodies_.mark(*log.tested, body);
  if (Bodies::is_mesh(b)) {
    std::uint8_t hidden = 0;
    if (is_traceable(ray)) kernels_.occluded(mesh_tree(b), body, {&ray, 1}, {&hidden, 1}, log.counts);
    return hidden;
  }
  const bool hit = intersect_single(*b.shape, ray).has_value();
  if (log.counts) Tally(*log.counts).object(hit);
  return hit;
}

template <typename Visit>
void WideAccel::visit_bodies(const Ray& ray, TraceLog log, Visit&& visit) const {
  const auto call = [](void* self, std::uint32_t body, float limit) {
    return (*static_cast<std::remove_reference_t<Visit>*>(self))(body, limit);
  };
  kernels_.visit_bodies(tree_, placed_, ray, {&visit, call}, log.counts);
}

template <typename Answer>
void WideAccel::search_together(std::span<const Ray> rays, std::span<Answer> answers, TraceLog log, bool is_fan) const {
  constexpr bool kAnyHit = std::is_same_v<Answer, std::uint8_t>;
  std::ranges::fill(answers, Answer());
  std::vector<float> limits;
  std::vector<std::uint32_t> picked;
  std::vector<Ray> world, local;
  std::vector<Answer> found;
  Directions directions;
  for (std::size_t first = 0; first < rays.size(); first += kStreamRays) {
    const auto some = rays.subspan(first, std::min(kStreamRays, rays.size() - first));
    const auto theirs = answers.subspan(first, some.size());
    limits.clear();
    for (const Ray& ray : some) limits.push_back(ray.t_max);
    auto visit = [&](std::uint32_t body, std::span<const std::uint32_t> members) {
      const Bodies::Body b = bodies_[body];
      picked.clear();
      world.clear();
      for (const std::uint32_t i : members)
        if (limits[i] != kStop) world.push_back(some[i]);
      if (pass_by(body, world)) return;
      if (log.tested) bodies_.mark(*log.tested, body);
      local.clear();
      found.clear();
      for (const std::uint32_t i : members) {
        if (limits[i] == kStop) continue;
        const Ray ray = b.placement ? b.placement->to_local(some[i]) : some[i];
        if (b.placement && Bodies::is_mesh(b) && !is_traceable(ray)) continue;
        picked.push_back(i);
        local.push_back(ray);
        found.push_back(theirs[i]);
      }
      if constexpr (kAnyHit) {
        occluded_on(body, std::nullopt, local, found, log.counts);
      } else if (is_fan && Bodies::is_mesh(b) && local.size() >= kLeastFan) {
        directions.clear();
        directions.append_those_of(local);
        closest_on_mesh(body, RayFan(local.front().origin, directions), found, log.counts);
      } else {
        closest_on(body, local, found, log.counts);
      }
      for (std::size_t k = 0; k < picked.size(); ++k) {
        theirs[picked[k]] = found[k];
        float& limit = limits[picked[k]];
        if constexpr (kAnyHit)
          limit = found[k] ? kStop : limit;
        else
          limit = std::min(limit, found[k].t);
      }
    };
    const auto call = [](void* self, std::uint32_t body, std::span<const std::uint32_t> members) {
      (*static_cast<decltype(visit)*>(self))(body, members);
    };
    kernels_.visit_bodies_together(tree_, placed_, some, limits, {&visit, call}, log.counts);
  }
}

std::optional<Hit> WideAccel::closest(const Ray& ray, TraceLog log) const {
  if (!is_traceable(ray)) return std::nullopt;
  Hit best{ray.t_max};
  if (is_lone_mesh())
    closest_in(0, ray, best, log);
  else
    visit_bodies(ray, log, [&](std::uint32_t body, float) {
      closest_in(body, ray, best, log);
      return best.t;
    });
  return best.t < ray.t_max ? std::optional(best) : std::nullopt;
}

bool WideAccel::occluded(const Ray& ray, TraceLog log) const {
  if (!is_traceable(ray)) return false;
  if (is_lone_mesh()) return occluded_by(0, ray, log);
  bool hidden = false;
  visit_bodies(ray, log, [&](std::uint32_t body, float limit) {
    hidden = occluded_by(body, ray, log);
    return hidden ? kStop : limit;
  });
  return hidden;
}

std::optional<Hit> WideAccel::closest_among(const Ray& ray, std::span<const std::uint32_t> bodies, TraceLog log) const {
  if (!is_traceable(ray)) return std::nullopt;
  Hit best{ray.t_max};
  const CullRay cull(ray, tree_.root, placed_);
  for (const std::uint32_t body : bodies)
    if (!cull.misses(boxes_[body], ray.t_min, best.t)) closest_in(body, ray, best, log);
  return best.t < ray.t_max ? std::optional(best) : std::nullopt;
}

std::optional<Hit> WideAccel::coincident(const Ray& ray, const Hit& hit, TraceLog log) const {
  return closest_at(ray, hit.t, {hit.object + 1, 0}, log);
}

std::optional<Hit> WideAccel::closest_at(const Ray& ray, float t, PrimitiveId least, TraceLog log) const {
  const Ray at = only_at(ray, t);
  if (!is_traceable(at)) return std::nullopt;
  Hit best{at.t_max};
  visit_bodies(at, log, [&](std::uint32_t body, float) {
    if (body >= least.object) closest_in(body, at, best, log, body == least.object ? least.primitive : 0);
    return best.t;
  });
  return best.t < at.t_max ? std::optional(best) : std::nullopt;
}

void WideAccel::closest(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log, Candidates among) const {
  const bool goes_through_few = among || are_few(boxes_.size(), rays.size());
  if (rays.empty() || (!goes_through_few && rays.size() < kLeastStream) || !all_traceable(rays))
    return Accel::closest(rays, hits, log, among);
  if (!goes_through_few) return search_together(rays, hits, log, false);
  const std::span<const std::uint32_t> bodies = among.value_or(all_);
  std::ranges::fill(hits, Hit{});
  if (is_lone_mesh() && bodies.size() == 1) {
    if (log.tested) bodies_.mark(*log.tested, 0);
    return closest_on(0, rays, hits, log.counts);
  }
  RayBatch<Hit> batch(tree_.root, placed_);
  batch.start(rays, hits, false);
  for (const std::uint32_t body : batch.near_to_far(bodies, boxes_)) {
    if (!pick(body, batch, log)) continue;
    closest_on(body, batch.rays(), batch.found(), log.counts);
    batch.put_back();
  }
}

void WideAccel::closest_fan(const RayFan& fan, std::span<Hit> hits, TraceLog log, Candidates among) const {
  if (!(fan.t_min >= 0)) return Accel::closest_fan(fan, hits, log, among);
  closest_endless({fan.origin, fan.x, fan.y, fan.z}, hits, log, among);
  if (fan.t_min == 0 && fan.t_max == kInfinity) return;
  // A closest hit that isn't before the end means that none is. One that isn't behind the beginning hides what is.
  std::vector<std::size_t> hidden;
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < fan.size(); ++i) {
    if (!(hits[i].t < fan.t_max)) {
      hits[i] = Hit{};
    } else if (hits[i].t <= fan.t_min) {
      hidden.push_back(i);
      rays.push_back(fan.ray(i));
    }
  }
  std::vector<Hit> behind(rays.size());
  closest(rays, behind, log, among);
  for (std::size_t i = 0; i < hidden.size(); ++i) hits[hidden[i]] = behind[i];
}

void WideAccel::closest_endless(const RayFan& fan, std::span<Hit> hits, TraceLog log, Candidates among) const {
  if (!among && boxes_.size() > kFewForFans && fan.size() >= kLeastStream) {
    std::vector<Ray> rays;
    rays.reserve(fan.size());
    for (std::size_t i = 0; i < fan.size(); ++i) rays.push_back(fan.ray(i));
    if (all_traceable(rays)) return search_together(rays, hits, log, true);
  }
  if (fan.size() == 0 || (!among && boxes_.size() > kFewForFans)) return Accel::closest_fan(fan, hits, log, among);
  const std::span<const std::uint32_t> bodies = among.value_or(all_);
  prefetch(fan, hits);
  std::ranges::fill(hits, Hit{});
  if (is_lone_mesh() && bodies.size() == 1) {
    if (log.tested) bodies_.mark(*log.tested, 0);
    return closest_on_mesh(0, fan, hits, log.counts);
  }
  RayBatch<Hit> batch(tree_.root, placed_);
  std::vector<Ray> rays;
  Directions directions;
  for (std::size_t first = 0; first < fan.size(); first += kFanRays) {
    const std::size_t count = std::min(kFanRays, fan.size() - first);
    rays.clear();
    for (std::size_t i = first; i < first + count; ++i) rays.push_back(fan.ray(i));
    if (!all_traceable(rays)) {
      Accel::closest_fan(fan.part(first, count), hits.subspan(first, count), log, among);
      continue;
    }
    batch.start(rays, hits.subspan(first, count), true);
    for (const std::uint32_t body : batch.near_to_far(bodies, boxes_)) {
      if (!pick(body, batch, log)) continue;
      if (Bodies::is_mesh(bodies_[body])) {
        directions.clear();
        if (!batch.is_whole()) directions.append_those_of(batch.rays());
        const RayFan picked(batch.rays().front().origin, directions);
        closest_on_mesh(body, batch.is_whole() ? fan.part(first, count) : picked, batch.found(), log.counts);
      } else {
        closest_on(body, batch.rays(), batch.found(), log.counts);
      }
      batch.put_back();
    }
  }
}

void WideAccel::occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const {
  occluded(rays, hidden, log, std::nullopt);
}

void WideAccel::occluded_fan(Vec3 apex, std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const {
  occluded(rays, hidden, log, apex);
}

void WideAccel::occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log,
                         std::optional<Vec3> apex) const {
  if (rays.empty()) return;
  const bool is_lone_fan = apex && is_lone_mesh();  // for which the kernel looks by itself
  if (!is_lone_fan && !all_traceable(rays)) return Accel::occluded(rays, hidden, log);
  std::ranges::fill(hidden, 0);
  if (is_lone_mesh()) {
    if (log.tested) bodies_.mark(*log.tested, 0);
    return occluded_on(0, apex, rays, hidden, log.counts);
  }
  std::span<const std::uint32_t> bodies = all_;
  std::vector<std::uint32_t> on_the_way;
  std::size_t count = boxes_.size();
  if (apex && count <= kFewToAsk) {
    bodies = on_the_way = bodies_to(*apex, rays);
    count = bodies.size();
  }
  if (!(apex ? count <= kFewForFans : are_few(count, rays.size()))) {
    if (rays.size() < kLeastStream) return Accel::occluded(rays, hidden, log);
    return search_together(rays, hidden, log, false);
  }
  RayBatch<std::uint8_t> batch(tree_.root, placed_);
  const std::size_t most = apex ? kFanRays : rays.size();
  for (std::size_t first = 0; first < rays.size(); first += most) {
    const std::size_t size = std::min(most, rays.size() - first);
    batch.start(rays.subspan(first, size), hidden.subspan(first, size), apex.has_value());
    for (const std::uint32_t body : bodies) {
      if (!pick(body, batch, log)) continue;
      // A placement rounds once more: of rays that lead to one point it makes rays that nearly do.
      const bool leads_there = apex && !bodies_[body].placement;
      occluded_on(body, leads_there ? apex : std::nullopt, batch.rays(), batch.found(), log.counts);
      batch.put_back();
    }
  }
}

template <typename Answer>
bool WideAccel::pick(std::uint32_t body, RayBatch<Answer>& batch, TraceLog log) const {
  const Bodies::Body& b = bodies_[body];
  const bool any =
      counted(log, [&](auto tally) { return batch.pick(boxes_[body], b.placement, Bodies::is_mesh(b), tally); });
  // Bundles of rays may seem to enter a box that none of them does.
  if (any && pass_by(body, batch.world_rays())) return false;
  if (any && log.tested) bodies_.mark(*log.tested, body);
  return any;
}

void WideAccel::closest_on(std::uint32_t body, std::span<const Ray> rays, std::span<Hit> hits,
                           TestCounts* counts) const {
  const Bodies::Body& b = bodies_[body];
  if (!Bodies::is_mesh(b)) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const std::optional<float> t = intersect_single(*b.shape, rays[i]);
      if (counts) Tally(*counts).object(t.has_value());
      if (t) hits[i] = std::min(hits[i], {*t, body, 0});
    }
    return;
  }
  const WideTree& mesh = mesh_tree(b);
  if (rays.size() >= kLeastStream) return kernels_.closest(mesh, body, rays, hits, counts);
  for (std::size_t i = 0; i < rays.size(); ++i)
    kernels_.closest(mesh, body, rays.subspan(i, 1), hits.subspan(i, 1), counts);
}

void WideAccel::closest_on_mesh(std::uint32_t body, const RayFan& fan, std::span<Hit> hits, TestCounts* counts) const {
  const WideTree& mesh = mesh_tree(bodies_[body]);
  for (std::size_t first = 0; first < fan.size(); first += kFanRays) {
    const std::size_t end = std::min(first + kFanRays, fan.size());
    if (kernels_.closest_fan(mesh, body, fan.part(first, end - first), hits.subspan(first, end - first), counts))
      continue;
    std::vector<Ray> rays;
    for (std::size_t i = first; i < end; ++i) rays.push_back(fan.ray(i));
    if (all_traceable(rays)) {
      closest_on(body, rays, hits.subspan(first, end - first), counts);
      continue;
    }
    for (std::size_t i = first; i < end; ++i)
      if (is_traceable(rays[i - first]))
        kernels_.closest(mesh, body, {&rays[i - first], 1}, hits.subspan(i, 1), counts);
  }
}

void WideAccel::occluded_on(std::uint32_t body, std::optional<Vec3> apex, std::span<const Ray> rays,
                            std::span<std::uint8_t> hidden, TestCounts* counts) const {
  const Bodies::Body& b = bodies_[body];
  if (!Bodies::is_mesh(b)) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hidden[i]) continue;
      hidden[i] = intersect_single(*b.shape, rays[i]).has_value();
      if (counts) Tally(*counts).object(hidden[i]);
    }
    return;
  }
  const WideTree& mesh = mesh_tree(b);
  if (!apex && rays.size() < kLeastStream) {
    for (std::size_t i = 0; i < rays.size(); ++i)
      kernels_.occluded(mesh, body, rays.subspan(i, 1), hidden.subspan(i, 1), counts);
    return;
  }
  if (!apex) return kernels_.occluded(mesh, body, rays, hidden, counts);
  for (std::size_t first = 0; first < rays.size(); first += kFanRays) {
    const std::size_t count = std::min(kFanRays, rays.size() - first);
    const auto some = rays.subspan(first, count);
    const auto answers = hidden.subspan(first, count);
    if (kernels_.occluded_fan(mesh, body, *apex, some, answers, counts)) continue;
    for (CubeSide& side : by_cube_sides(some, answers)) {
      if (!kernels_.occluded_fan(mesh, body, *apex, side.rays, side.hidden, counts))
        occluded_on(body, std::nullopt, side.rays, side.hidden, counts);
      for (std::size_t i = 0; i < side.places.size(); ++i) answers[side.places[i]] = side.hidden[i];
    }
  }
}

std::vector<std::uint32_t> WideAccel::bodies_to(Vec3 apex, std::span<const Ray> rays) const {
  std::vector<std::uint32_t> some;
  const WayToPoint way(rays, apex, tree_.root, placed_);
  for (const std::uint32_t body : all_)
    if (!way.misses(boxes_[body])) some.push_back(body);
  return some;
}

bool WideAccel::are_few(std::size_t bodies, std::size_t rays) {
  return bodies <= std::min(std::max(kFewForOthers, rays / kRaysForEach), kFewToAsk);
}

const WideTree& WideAccel::mesh_tree(const Bodies::Body& body) const {
  return meshes_[body.hierarchy].get([&] {
    if (body.shape == nullptr) return make_(bodies_.joined_mesh(body));
    return make_(std::get<TriangleMesh>(*body.shape));
  });
}

bool WideAccel::is_lone_mesh() const {
  return bodies_.size() == 1 && !bodies_[0].placement && Bodies::is_mesh(bodies_[0]);
}

AccelStats WideAccel::stats() const {
  AccelStats sum = tree_.stats;
  std::uint32_t deepest = 0;
  std::vector<bool> is_counted(meshes_.size(), false);
  for (std::uint32_t body = 0; body < bodies_.size(); ++body) {
    const std::uint32_t hierarchy = bodies_[body].hierarchy;
    if (!Bodies::is_mesh(bodies_[body]) || is_counted[hierarchy]) continue;
    is_counted[hierarchy] = true;
    ++sum.meshes;
    const LazyTree::Ready* ready = meshes_[hierarchy].ready();
    if (!ready) continue;
    const AccelStats& mesh = ready->made.tree.stats;
    sum.bytes += mesh.bytes;
    sum.nodes += mesh.nodes;
    sum.leaves += mesh.leaves;
    deepest = std::max(deepest, mesh.depth);
    ++sum.meshes_ready;
    sum.meshes_loaded += ready->made.was_kept;
    sum.mesh_seconds += ready->seconds;
  }
  sum.bytes += boxes_.size() * sizeof(Aabb) + all_.size() * sizeof(std::uint32_t) + meshes_.size() * sizeof(LazyTree) +
               bodies_.bytes();
  sum.depth += deepest;
  return sum;
}

std::unique_ptr<const Accel> make_wide(std::shared_ptr<const Scene> scene, const AccelOptions& options,
                                       const WideKernels& kernels, MakeTree make) {
  Bodies bodies = Bodies::joined(std::move(scene));
  if (bodies.are_joined()) return std::make_unique<const JoinedAccel>(std::move(bodies), kernels, std::move(make));
  return std::make_unique<const WideAccel>(bodies.shared_scene(), options, kernels, std::move(make));
}

std::unique_ptr<const Accel> make_wide(std::shared_ptr<const Scene> scene, const AccelOptions& options) {
  return make_wide(std::move(scene), options, wide_kernels(), WideAccel::build_tree);
}

}  // namespace tessera
