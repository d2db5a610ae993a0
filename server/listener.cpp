#include "server/listener.h"

#include <chrono>
#include <exception>
#include <sstream>
#include <stdexcept>
#include <string>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <spdlog/spdlog.h>

namespace tessera::server {
namespace asio = boost::asio;
using asio::ip::tcp;

namespace {

constexpr auto kAwait = asio::as_tuple(asio::use_awaitable);
/// When the process is out of file descriptors, accepting fails until some connection ends.
constexpr std::chrono::milliseconds kPauseAfterError{100};

void log_end(std::exception_ptr error) {
  if (!error) return;
  try {
    std::rethrow_exception(error);
  } catch (const std::exception& e) {
    spdlog::error("a connection ended: {}", e.what());
  }
}

}  // namespace

tcp::acceptor listen_on(asio::io_context& io, const std::string& host, std::uint16_t port) {
  boost::system::error_code error;
  const auto address = asio::ip::make_address(host, error);
  if (error) throw std::runtime_error("--host takes an IP address, not " + host);
  try {
    return tcp::acceptor(asio::make_strand(io), tcp::endpoint(address, port));
  } catch (const boost::system::system_error& e) {
    throw std::runtime_error("cannot listen on " + host + " port " + std::to_string(port) + ": " + e.code().message());
  }
}

asio::awaitable<void> accept_all(asio::io_context& io, tcp::acceptor& acceptor, Connections& connections) {
  while (acceptor.is_open()) {
    auto [error, socket] = co_await acceptor.async_accept(asio::make_strand(io), kAwait);
    if (!error) {
      const auto strand = socket.get_executor();
      asio::co_spawn(strand, serve(std::move(socket), connections), log_end);
    } else if (error != asio::error::operation_aborted) {
      spdlog::warn("cannot accept: {}", error.message());
      asio::steady_timer pause(io, kPauseAfterError);
      co_await pause.async_wait(kAwait);
    }
  }
}

std::string url_of(const tcp::acceptor& acceptor) {
  std::ostringstream url;
  url << "http://" << acceptor.local_endpoint();
  return url.str();
}

}  // namespace tessera::server
