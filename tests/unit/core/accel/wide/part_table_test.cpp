#include "core/accel/wide/part_table.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

TEST(PartTable, FindsEveryNumbersPart) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed);
    std::vector<std::uint32_t> begins, owner;
    const std::uint64_t parts = 1 + random.bits() % 40, most = 1 + random.bits() % (seed % 3 == 0 ? 200 : 5);
    for (std::uint32_t part = 0; part < parts; ++part) {
      begins.push_back(static_cast<std::uint32_t>(owner.size()));
      owner.resize(owner.size() + random.bits() % most + (part == 0 ? 1 : 0), part);
    }
    const PartTable table(begins, static_cast<std::uint32_t>(owner.size()));
    for (std::uint32_t i = 0; i < owner.size(); ++i) ASSERT_EQ(table.part_of(i, begins), owner[i]) << seed << ": " << i;
  }
}

}  // namespace
}  // namespace tessera
