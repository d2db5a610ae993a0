#pragma once

#include "server/config.h"

namespace tessera::server {

/// Listens, says where on stdout, and serves until SIGTERM or SIGINT; then stops accepting, cancels what renders,
/// lets requests in progress finish for a moment, and returns. Logs to stderr. Throws when it can't start: the
/// port is taken, the data folder can't be made or is another daemon's.
void run_daemon(const Config& config);

}  // namespace tessera::server
