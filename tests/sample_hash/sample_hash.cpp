// Prints a hash of what decides where samples fall and what elementary functions give: STRESS 62 builds this with and
// without optimisation and compares the lines.
#include <bit>
#include <cstdint>
#include <cstdio>

#include "core/math/portable.h"
#include "core/math/portable_float.h"
#include "core/math/vec.h"
#include "core/math/vec2.h"
#include "core/sampling/dimensions.h"
#include "core/sampling/pixel_filter.h"
#include "core/sampling/pixel_samples.h"
#include "core/sampling/sampler.h"
#include "core/sampling/warp.h"
#include "core/scene/settings.h"
#include "tests/support/random.h"

namespace {

/// FNV-1a over the bits of each number, in order.
class Hash {
 public:
  void add(double v) {
    for (std::uint64_t bits = std::bit_cast<std::uint64_t>(v), i = 0; i < 8; ++i, bits >>= 8)
      value_ = (value_ ^ (bits & 0xFF)) * 0x100000001B3ULL;
  }
  unsigned long long value() const { return value_; }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325ULL;
};

unsigned long long hash_samples() {
  Hash hash;
  for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1} << 63})
    for (std::uint32_t y = 0; y < 40; ++y)
      for (std::uint32_t x = 0; x < 40; ++x)
        for (const std::uint32_t count : {1U, 2U, 6U, 7U, 16U})
          for (std::uint32_t i = 0; i < count; ++i) {
            const auto at = tessera::PixelOffsets(seed, count, true).of(x * 977, y * 1663, i);
            hash.add(at.x);
            hash.add(at.y);
          }
  using tessera::SamplerKind, tessera::FilterKind, tessera::Decision;
  for (const auto kind : {SamplerKind::grid, SamplerKind::independent, SamplerKind::sobol})
    for (const std::uint32_t replicates : {1U, 2U}) {
      const tessera::Sampler sampler({.kind = kind, .seed = 5, .samples = 12, .replicates = replicates});
      for (std::int32_t pixel = 0; pixel < 400; ++pixel)
        for (std::uint32_t i = 0; i < 12; ++i) {
          const tessera::SampleId id{pixel * 977, pixel * 1663, i};
          for (const auto filter : {FilterKind::box, FilterKind::gaussian, FilterKind::blackman_harris}) {
            const auto at = tessera::PixelFilter(filter, 2).sample(sampler.film(id));
            hash.add(at.x);
            hash.add(at.y);
          }
          const tessera::PathSample sample = sampler.at(id);
          hash.add(sample.one(tessera::dimension(i, Decision::roulette)));
          const tessera::Vec2 u = sample.two(tessera::dimension(i, Decision::bsdf));
          for (const tessera::Vec3 d : {tessera::cosine_hemisphere(u), tessera::uniform_sphere(u)}) {
            hash.add(d.x);
            hash.add(d.y);
            hash.add(d.z);
          }
        }
    }
  return hash.value();
}

unsigned long long hash_functions() {
  Hash hash;
  tessera::Random random(1);
  for (int i = 0; i < 20'000; ++i) {
    const double angle = random.uniform(-12.5, 12.5), size = random.magnitude(-20, 20);
    const double any = random.uniform(-1, 1) * size;
    for (const auto f : {tessera::portable_sin, tessera::portable_cos, tessera::portable_tan}) hash.add(f(angle));
    hash.add(tessera::portable_atan(any));
    hash.add(tessera::portable_log2(random.magnitude(-300, 300)));
    hash.add(tessera::portable_exp2(random.uniform(-1080, 1030)));
    const double base = random.magnitude(-3, 3), exponent = random.magnitude(-3, 3);
    hash.add(tessera::portable_pow(static_cast<float>(base), static_cast<float>(exponent)));
    const auto x = static_cast<float>(angle), y = static_cast<float>(any);
    for (const auto& [s, c] : {tessera::sin_cos_turns(x), tessera::portable_sin_cos(x)}) {
      hash.add(s);
      hash.add(c);
    }
    hash.add(tessera::portable_acos(x / 16));
    hash.add(tessera::portable_atan2(x, y));
  }
  return hash.value();
}

}  // namespace

int main() { std::printf("samples %016llx functions %016llx\n", hash_samples(), hash_functions()); }
