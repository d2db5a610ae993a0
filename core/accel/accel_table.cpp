#include "core/accel/accel_table.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "core/accel/make.h"
#include "core/math/float_environment.h"

namespace tessera {
namespace {

using std::string_view;
using Type = AccelOptionType;

constexpr std::array kOptions{
    AccelOptionEntry{"bound", "what encloses objects, groups and nodes", Type::bound},
    AccelOptionEntry{"space", "where an instance is enclosed: in the world, or in its shape's own space", Type::space},
    AccelOptionEntry{"normals", "of the slabs: a preset's number (3, 7, 9, 13), or vectors", Type::normals, nullptr, 0,
                     0, BoundKind::slabs},
    AccelOptionEntry{"max_faces", "of a hull that rays are clipped against", Type::number, &AccelOptions::max_faces, 4,
                     1024, BoundKind::hull},
    AccelOptionEntry{"group_size",
                     "objects, or triangles of a mesh, under one bound; 0: one object, and √n of n triangles",
                     Type::number, &AccelOptions::group_size, 0, 1U << 20},
    AccelOptionEntry{"leaf_size", "items that a leaf may hold without being split", Type::number,
                     &AccelOptions::leaf_size, 1, 255},
    AccelOptionEntry{"max_depth", "levels below the root at most; 0: as the number of items asks for", Type::number,
                     &AccelOptions::max_depth, 0, 60},
    AccelOptionEntry{"cells_per_item", "cells of the grid for each item in it", Type::number,
                     &AccelOptions::cells_per_item, 1, 64},
};

constexpr std::array<string_view, 5> kBoundsOptions{"bound", "space", "normals", "max_faces", "group_size"};
constexpr std::array<string_view, 5> kBvhOptions{"bound", "space", "normals", "max_faces", "leaf_size"};
constexpr std::array<string_view, 1> kGridOptions{"cells_per_item"};
constexpr std::array<string_view, 2> kPlaneOptions{"leaf_size", "max_depth"};

constexpr std::array kTable{
    AccelEntry{
        AccelKind::brute, "brute", "every candidate primitive, one by one; nothing is built", false, {}, make_brute},
    AccelEntry{AccelKind::bounds, "bounds", "a flat list of bounds around objects and groups of triangles", true,
               kBoundsOptions, make_bounds},
    AccelEntry{AccelKind::bvh, "bvh", "a SAH hierarchy of bounds over objects, and one over each mesh", true,
               kBvhOptions, make_bvh},
    AccelEntry{AccelKind::grid, "grid", "a uniform grid over objects, and one over each mesh", true, kGridOptions,
               make_grid},
    AccelEntry{AccelKind::octree, "octree", "cells halved on all three axes at their middle, 20 levels deep at most",
               true, kPlaneOptions, make_octree},
    AccelEntry{AccelKind::kd, "kd", "cells cut by axis-aligned planes where the SAH says", true, kPlaneOptions,
               make_kd},
    AccelEntry{AccelKind::bsp, "bsp", "cells cut by planes of any direction where the SAH says", true, kPlaneOptions,
               make_bsp},
    AccelEntry{AccelKind::wide,
               "wide",
               "an eight-wide SAH hierarchy over each mesh, searched by vector instructions",
               true,
               {},
               make_wide},
};
constexpr std::array<string_view, 4> kBoundNames{"box", "sphere", "slabs", "hull"};
constexpr std::array<string_view, 2> kSpaceNames{"world", "object"};

/// The shortest text that reads back as the same float.
std::string text(float v) {
  std::array<char, 32> buffer;
  return {buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), v).ptr};
}

std::string text(const std::vector<Vec3>& normals) {
  std::string list;
  for (const Vec3 n : normals) list += '(' + text(n.x) + ',' + text(n.y) + ',' + text(n.z) + ')';
  return list;
}

std::string value_text(const AccelOptionEntry& option, const AccelOptions& options) {
  switch (option.type) {
    case Type::number:
      return std::to_string(options.*option.number);
    case Type::bound:
      return std::string(kBoundNames[static_cast<std::size_t>(options.bound)]);
    case Type::space:
      return std::string(kSpaceNames[static_cast<std::size_t>(options.space)]);
    case Type::normals:
      return text(options.normals);
  }
  return {};
}

}  // namespace

std::span<const AccelOptionEntry> accel_option_table() { return kOptions; }
std::span<const AccelEntry> accel_table() { return kTable; }
std::span<const string_view> bound_names() { return kBoundNames; }
std::span<const string_view> space_names() { return kSpaceNames; }

const AccelEntry* accel_entry(AccelKind kind) {
  const auto row = std::ranges::find(kTable, kind, &AccelEntry::kind);
  return row == kTable.end() ? nullptr : &*row;
}

std::string_view accel_name(AccelKind kind) {
  const AccelEntry* row = accel_entry(kind);
  return row ? row->name : "auto";
}

std::string describe(const AccelOptions& options) {
  std::string out(accel_name(options.kind));
  const AccelEntry* row = accel_entry(options.kind);
  for (const AccelOptionEntry& option : kOptions) {
    if (!row || std::ranges::find(row->options, option.name) == row->options.end()) continue;
    if (option.only_with && *option.only_with != options.bound) continue;
    out += ' ' + std::string(option.name) + '=' + value_text(option, options);
  }
  return out;
}

std::unique_ptr<const Accel> make_accel(std::shared_ptr<const Scene> scene, const AccelOptions& options) {
  const StrictFloats strict;
  return accel_entry(options.kind)->make(std::move(scene), options);
}

}  // namespace tessera
