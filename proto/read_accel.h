#pragma once

#include "core/scene/accel_options.h"
#include "proto/json_cursor.h"

namespace tessera::proto {

/// A structure and its options, by the rules of the readers in json_cursor.h. Which kinds and options there are, and
/// which kind uses which, is `accel_table()`'s to say; an option that isn't used is an error.
void read_accel(JsonCursor value, AccelOptions& accel);

}  // namespace tessera::proto
