#pragma once

#include "proto/json_cursor.h"
#include "proto/parse.h"

namespace tessera::proto {

/// A job's settings, by the rules of the readers in json_cursor.h. A setting that another one makes useless is an
/// error; what only the scene can tell is left to `check_integrator`.
void read_settings(JsonCursor value, JobRequest& job);

}  // namespace tessera::proto
