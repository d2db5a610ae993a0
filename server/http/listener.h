#pragma once

#include <string>

#include "server/http/session.h"

namespace tessera::server {

/// Listens on host:port (0: any free port). Throws std::runtime_error when it can't.
FileDescriptor listen_on(const std::string& host, std::uint16_t port);

/// Accepts connections and begins to serve them on `loop`, until the server shuts down. Several loops may share one
/// socket. While as many are open as there may be, or the system has no more to give, others wait in the system's
/// queue.
Detached accept_all(EventLoop& loop, const FileDescriptor& listening, Connections& connections);

/// The address that a socket has, or was connected to, as "127.0.0.1:8080" or "[::1]:8080". Throws std::runtime_error
/// when it can't be told.
std::string address_of(int socket);

/// "http://127.0.0.1:8080", with the port that it got; "https://" where connections speak TLS.
std::string url_of(const FileDescriptor& listening, bool is_tls);

}  // namespace tessera::server
