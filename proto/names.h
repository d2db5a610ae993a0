#pragma once

#include <span>

#include "core/scene/settings.h"
#include "proto/choice.h"
#include "proto/import/import.h"

namespace tessera::proto {

// The words that a document and an answer share, in the order in which they are listed. Those of structures and their
// options stand in core/accel/accel_table.h.
std::span<const Choice<ScreenBounds>> screen_bounds_names();
std::span<const Choice<Aov>> aov_names();
std::span<const Choice<FileFormat>> file_format_names();

}  // namespace tessera::proto
