#pragma once

#include <atomic>
#include <cstdint>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/thread_pool.hpp>

#include "server/services.h"

namespace tessera::server {

/// What all connections share.
struct Connections {
  Services& services;
  boost::asio::thread_pool& workers;         ///< Runs the handlers that aren't for I/O threads.
  std::atomic<int> requests_active{0};       ///< Header read, response not written yet.
  std::atomic<std::uint64_t> body_bytes{0};  ///< Of JSON documents held by connections.
};

/// Serves HTTP/1.1 on one connection, request after request, until either side closes it. The socket's executor
/// is a strand, or single-threaded.
boost::asio::awaitable<void> serve(boost::asio::ip::tcp::socket socket, Connections& connections);

}  // namespace tessera::server
