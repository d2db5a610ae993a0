#pragma once

#include "proto/json_cursor.h"
#include "proto/parse.h"

namespace tessera::proto {

/// A job's settings, by the rules of the readers in json_cursor.h. What an integrator doesn't read is left to
/// `refuse_unread`. A transparent image records its alpha.
void read_settings(JsonCursor value, JobRequest& job);

/// Says what of the settings `integrator` wouldn't read. Precondition: it isn't `automatic`.
void refuse_unread(IntegratorKind integrator, const Settings& settings, FieldErrors& errors);

}  // namespace tessera::proto
