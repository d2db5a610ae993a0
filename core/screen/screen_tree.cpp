#include "core/screen/screen_tree.h"

#include <algorithm>
#include <bit>
#include <span>

namespace tessera {
namespace {

constexpr std::uint32_t kLargestLeaf = 4;

/// Twice a rectangle's centre.
struct Center {
  std::int64_t x, y;
};
Center center(const ScreenPart& part) {
  return {std::int64_t{part.area.x0} + part.area.x1, std::int64_t{part.area.y0} + part.area.y1};
}

PixelRect join(PixelRect a, PixelRect b) {
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

/// Moves the parts on the near side of the middle of all centres to the front and returns how many they are; all,
/// where the centres are one.
std::size_t split(std::span<ScreenPart> parts) {
  Center lo = center(parts[0]), hi = lo;
  for (const ScreenPart& part : parts) {
    const Center c = center(part);
    lo = {std::min(lo.x, c.x), std::min(lo.y, c.y)};
    hi = {std::max(hi.x, c.x), std::max(hi.y, c.y)};
  }
  if (lo.x == hi.x && lo.y == hi.y) return parts.size();
  const bool across = hi.x - lo.x >= hi.y - lo.y;
  const std::int64_t middle = across ? lo.x + (hi.x - lo.x) / 2 : lo.y + (hi.y - lo.y) / 2;
  const auto far = std::partition(parts.begin(), parts.end(), [&](const ScreenPart& part) {
    return (across ? center(part).x : center(part).y) <= middle;
  });
  return static_cast<std::size_t>(far - parts.begin());
}

}  // namespace

ScreenTree::ScreenTree(std::vector<ScreenPart> parts) : parts_(std::move(parts)) {
  if (parts_.empty()) return;
  nodes_.emplace_back();
  build(0, 0, static_cast<std::uint32_t>(parts_.size()));
}

/// Halves the range of centres, which are whole numbers: no deeper than twice their 33 bits, however the parts lie.
void ScreenTree::build(std::uint32_t node, std::uint32_t begin, std::uint32_t end) {
  PixelRect area = parts_[begin].area;
  for (std::uint32_t i = begin + 1; i < end; ++i) area = join(area, parts_[i].area);
  const std::uint32_t count = end - begin;
  const std::uint32_t near =
      count <= kLargestLeaf ? count : static_cast<std::uint32_t>(split(std::span(parts_).subspan(begin, count)));
  if (near == count) {
    nodes_[node] = {area, begin, count};
    return;
  }
  const auto children = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(children + 2);
  nodes_[node] = {area, children, 0};
  build(children, begin, begin + near);
  build(children + 1, begin + near, end);
}

template <typename Take>
bool ScreenTree::visit(std::uint32_t node, PixelRect rect, Take&& take) const {
  const auto [area, first, count] = nodes_[node];
  if (!overlap(area, rect)) return true;
  if (count == 0) return visit(first, rect, take) && visit(first + 1, rect, take);
  for (const ScreenPart& part : std::span(parts_).subspan(first, count))
    if (overlap(part.area, rect) && !take(part)) return false;
  return true;
}

std::vector<std::uint32_t> ScreenTree::objects_in(PixelRect rect, std::size_t most) const {
  std::vector<std::uint32_t> objects;
  if (nodes_.empty()) return objects;
  visit(0, rect, [&](const ScreenPart& part) {
    const auto at = std::ranges::lower_bound(objects, part.object);
    if (at == objects.end() || *at != part.object) objects.insert(at, part.object);
    return objects.size() <= most;
  });
  return objects;
}

bool ScreenTree::covers_half(PixelRect rect) const {
  constexpr std::int64_t kCells = 8;
  std::uint64_t covered = 0;
  // Bits [first, last) of the cells that [lo, hi) overlaps, of `size` pixels from `origin`.
  const auto cells = [](std::int64_t lo, std::int64_t hi, std::int64_t origin, std::int64_t size) {
    const std::int64_t first = (lo - origin) * kCells / size, last = ((hi - origin) * kCells + size - 1) / size;
    return (std::uint64_t{1} << last) - (std::uint64_t{1} << first);
  };
  const auto half = [&] { return std::popcount(covered) * 2 >= kCells * kCells; };
  if (nodes_.empty()) return false;
  visit(0, rect, [&](const ScreenPart& part) {
    const PixelRect area = intersect(part.area, rect);
    const std::uint64_t columns = cells(area.x0, area.x1, rect.x0, rect.width());
    const std::uint64_t rows = cells(area.y0, area.y1, rect.y0, rect.height());
    for (std::int64_t y = 0; y < kCells; ++y)
      if (rows >> y & 1) covered |= columns << (y * kCells);
    return !half();
  });
  return half();
}

}  // namespace tessera
