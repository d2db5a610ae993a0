#include "core/accel/accel.h"

#include <array>

#include "core/accel/box_tree.h"
#include "core/accel/linear_index.h"
#include "core/accel/two_level.h"

namespace tessera {
namespace {

template <typename Index>
std::unique_ptr<const Accel> make(std::shared_ptr<const Scene> scene) {
  return std::make_unique<const TwoLevel<Index>>(std::move(scene));
}

constexpr std::array kTable{
    AccelEntry{AccelKind::brute, "brute", "every candidate primitive, one by one; nothing is built", false,
               make<LinearIndex>},
    AccelEntry{AccelKind::bvh, "bvh", "a SAH hierarchy of boxes over objects, and one over each mesh", true,
               make<BoxTree>},
};

const AccelEntry* find(AccelKind kind) {
  for (const AccelEntry& row : kTable)
    if (row.kind == kind) return &row;
  return nullptr;
}

}  // namespace

std::span<const AccelEntry> accel_table() { return kTable; }

std::unique_ptr<const Accel> make_accel(std::shared_ptr<const Scene> scene, AccelKind kind) {
  return find(kind)->make(std::move(scene));
}

std::string_view accel_name(AccelKind kind) {
  const AccelEntry* row = find(kind);
  return row ? row->name : "auto";
}

}  // namespace tessera
