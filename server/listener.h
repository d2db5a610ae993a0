#pragma once

#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "server/session.h"

namespace tessera::server {

/// Listens on host:port (0: any free port), on a strand of its own. Throws std::runtime_error when it can't.
boost::asio::ip::tcp::acceptor listen_on(boost::asio::io_context& io, const std::string& host, std::uint16_t port);

/// Accepts connections, each served on a strand of its own, until the acceptor is closed. Runs on the acceptor's
/// executor.
boost::asio::awaitable<void> accept_all(boost::asio::io_context& io, boost::asio::ip::tcp::acceptor& acceptor,
                                        Connections& connections);

/// "http://127.0.0.1:8080", with the port that it got.
std::string url_of(const boost::asio::ip::tcp::acceptor& acceptor);

}  // namespace tessera::server
