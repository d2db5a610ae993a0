#pragma once

#include <optional>

#include "proto/json_cursor.h"
#include "proto/parse.h"

namespace tessera::proto {

/// Reads a scene document that stands at `document`, and the files that it names. Says what is wrong there and
/// gives nothing when anything is, or when the document's errors weren't empty before.
std::optional<ParsedScene> read_scene(const JsonCursor& document, const FileSource& files, const Limits& limits);

}  // namespace tessera::proto
