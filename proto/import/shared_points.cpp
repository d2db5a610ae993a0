#include "proto/import/shared_points.h"

#include <algorithm>
#include <bit>

namespace tessera::proto {
namespace {

constexpr std::size_t kLeastSlots = 64;

/// So far beyond the usual that somebody made the file for it.
constexpr int kMostProbes = 64;

std::uint32_t bits(float v) { return std::bit_cast<std::uint32_t>(v); }

bool are_same(Vec3 a, Vec3 b) { return bits(a.x) == bits(b.x) && bits(a.y) == bits(b.y) && bits(a.z) == bits(b.z); }

/// The finaliser of SplitMix64 (Steele et al. 2014).
std::uint64_t mixed(std::uint64_t v) {
  v = (v ^ v >> 30) * 0xBF58476D1CE4E5B9;
  v = (v ^ v >> 27) * 0x94D049BB133111EB;
  return v ^ v >> 31;
}

std::uint64_t hash(Vec3 p) {
  return mixed(mixed(std::uint64_t{bits(p.x)} << 32 | bits(p.y)) + 0x9E3779B97F4A7C15 + bits(p.z));
}

}  // namespace

std::uint32_t SharedPoints::number(Vec3 point) {
  point = {point.x + 0.0F, point.y + 0.0F, point.z + 0.0F};
  if (2 * (points_.size() + 1) > slots_.size()) grow();
  std::uint32_t* const found = slot(point);
  if (found && *found != kNone) return *found;
  const auto added = static_cast<std::uint32_t>(points_.size());
  points_.push_back(point);
  if (found) *found = added;
  return added;
}

std::uint32_t* SharedPoints::slot(Vec3 point) {
  const std::size_t mask = slots_.size() - 1;
  std::size_t at = hash(point) & mask;
  for (int i = 0; i < kMostProbes; ++i, at = (at + 1) & mask)
    if (slots_[at] == kNone || are_same(points_[slots_[at]], point)) return &slots_[at];
  return nullptr;
}

void SharedPoints::grow() {
  slots_.assign(std::max(kLeastSlots, 2 * slots_.size()), kNone);
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    std::uint32_t* const found = slot(points_[i]);
    if (found && *found == kNone) *found = i;
  }
}

}  // namespace tessera::proto
