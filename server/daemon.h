#pragma once

#include "server/config.h"

namespace tessera::server {

/// Listens, says where on stdout, and serves until SIGTERM or SIGINT; then takes no more jobs and lets those that there
/// are go on for a while, ends what is left, lets requests in progress finish for a moment, and returns. A second
/// signal shortens that. On SIGHUP it puts in force what `read_again` gives of what may change, reads the keys again,
/// and goes on. Tells systemd. Logs to stderr. The exit status: 1 when it can't start, since the port is taken, say,
/// the data folder can't be made or is another daemon's, or there are no keys where others than this machine reach it.
/// To be called once, before any other thread is made.
int run_daemon(const Config& config, const ReadConfig& read_again);

}  // namespace tessera::server
