#pragma once

#include <iosfwd>

#include "server/config.h"

namespace tessera::server {

/// Checks all files in the data folder, and in the structures' where there is one, against their hashes, and sets those
/// aside that are damaged: a line of `out` for each, and one for the sum. The exit status: 0 when all are whole, 1 when
/// some weren't, 2 when it couldn't look at all of them, of which `errors` tells: since a daemon has the folder, say.
int scrub(const Config& config, std::ostream& out, std::ostream& errors);

}  // namespace tessera::server
