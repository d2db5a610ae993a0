// Prints a hash of what decides where samples fall and what elementary functions give: STRESS 62 builds this with and
// without optimisation and compares the lines.
#include <bit>
#include <cstdint>
#include <cstdio>

#include "core/math/portable.h"
#include "core/sampling/pixel_samples.h"
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
  return hash.value();
}

unsigned long long hash_functions() {
  Hash hash;
  tessera::Random random(1);
  for (int i = 0; i < 20'000; ++i) {
    const double angle = random.uniform(-12.5, 12.5), any = random.uniform(-1, 1) * random.magnitude(-20, 20);
    for (const auto f : {tessera::portable_sin, tessera::portable_cos, tessera::portable_tan}) hash.add(f(angle));
    hash.add(tessera::portable_atan(any));
    hash.add(tessera::portable_log2(random.magnitude(-300, 300)));
    hash.add(tessera::portable_exp2(random.uniform(-1080, 1030)));
    hash.add(tessera::portable_pow(static_cast<float>(random.magnitude(-3, 3)),
                                   static_cast<float>(random.magnitude(-3, 3))));
  }
  return hash.value();
}

}  // namespace

int main() { std::printf("samples %016llx functions %016llx\n", hash_samples(), hash_functions()); }
