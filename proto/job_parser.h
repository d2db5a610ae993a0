#pragma once

#include <optional>

#include "proto/json_cursor.h"
#include "proto/parse.h"

namespace tessera::proto {

/// Reads a job document that stands at `document`, by the rules of `read_scene`.
std::optional<JobRequest> read_job(const JsonCursor& document, const FileSource& files, const Limits& limits);

}  // namespace tessera::proto
