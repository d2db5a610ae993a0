#include "proto/names.h"

#include <vector>

#include "core/film/aov_table.h"

namespace tessera::proto {

std::span<const Choice<ScreenBounds>> screen_bounds_names() {
  static constexpr Choice<ScreenBounds> table[] = {
      {"off", ScreenBounds::off}, {"flat", ScreenBounds::flat}, {"hierarchical", ScreenBounds::hierarchical}};
  return table;
}

std::span<const Choice<Aov>> aov_names() {
  static const std::vector<Choice<Aov>> table = [] {
    std::vector<Choice<Aov>> names;
    for (const AovEntry& row : aov_table()) names.push_back({row.name, row.aov});
    return names;
  }();
  return table;
}

std::span<const Choice<FileFormat>> file_format_names() {
  static constexpr Choice<FileFormat> table[] = {
      {"obj", FileFormat::obj}, {"ply", FileFormat::ply}, {"nff", FileFormat::nff}};
  return table;
}

}  // namespace tessera::proto
