#include "server/http/listener.h"

#include <cerrno>
#include <chrono>
#include <exception>
#include <memory>
#include <new>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

namespace tessera::server {
namespace {

/// Before it is tried again to accept what can't be accepted now: some connection has to end first.
constexpr std::chrono::milliseconds kPause{50};
/// What a peer may take to get on while others wait for its place: much more than a request takes whose sender doesn't
/// dawdle.
constexpr std::chrono::milliseconds kPatience{250};

bool is_anyone_waiting(const FileDescriptor& listening) {
  pollfd poll{listening.value(), POLLIN, 0};
  return ::poll(&poll, 1, 0) > 0;
}

std::string why(int error) { return std::generic_category().message(error); }

void serve_next(EventLoop& loop, FileDescriptor socket, Connections& connections) {
  const int yes = 1;
  ::setsockopt(socket.value(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  serve(loop, std::move(socket), connections).handle.resume();
}

}  // namespace

FileDescriptor listen_on(const std::string& host, std::uint16_t port) {
  addrinfo wanted{}, *found = nullptr;
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV | AI_PASSIVE;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found) != 0 || host.empty())
    throw std::runtime_error("--host takes an IP address, not " + host);
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> address(found, &::freeaddrinfo);
  FileDescriptor socket(::socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int yes = 1;
  if (!socket || ::setsockopt(socket.value(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
      ::bind(socket.value(), address->ai_addr, address->ai_addrlen) != 0 || ::listen(socket.value(), SOMAXCONN) != 0)
    throw std::runtime_error("cannot listen on " + host + " port " + std::to_string(port) + ": " + why(errno));
  return socket;
}

Detached accept_all(EventLoop& loop, const FileDescriptor& listening, Connections& connections) {
  const std::coroutine_handle<> coroutine = co_await ThisCoroutine{};
  Channel channel(loop, FileDescriptor(::fcntl(listening.value(), F_DUPFD_CLOEXEC, 0)), coroutine);
  bool has_complained = false, is_crowded = false;
  while (!connections.services.shutting_down) {
    channel.never_expires();
    if (connections.open >= connections.services.most_connections) {
      if (is_anyone_waiting(listening) && loop.make_room(kPatience)) {
        if (!std::exchange(is_crowded, true))
          spdlog::warn("{} connections are open, as many as may be: those that wait for their peers longest are closed",
                       connections.open.load());
        EventLoop::Message has_ended;
        has_ended.to = &channel;
        loop.post(has_ended);
        while (!has_ended.is_done) co_await channel.change();
        continue;
      }
      channel.expires_after(kPause);
      co_await channel.change();
      continue;
    }
    FileDescriptor socket(::accept4(listening.value(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    int error = socket ? 0 : errno;
    try {
      if (socket) serve_next(loop, std::move(socket), connections);
    } catch (const std::bad_alloc&) {
      error = ENOMEM;
    }
    if (error == 0) {
      has_complained = false;
    } else if (error == EAGAIN) {
      is_crowded = false;
      co_await channel.change();
    } else if (error != EINTR && error != ECONNABORTED) {
      if (!std::exchange(has_complained, true)) spdlog::warn("cannot accept connections: error {}", error);
      channel.expires_after(kPause);
      co_await channel.change();
    }
  }
}

std::string address_of(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  char host[NI_MAXHOST], port[NI_MAXSERV];
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
      ::getnameinfo(reinterpret_cast<sockaddr*>(&address), size, host, sizeof host, port, sizeof port,
                    NI_NUMERICHOST | NI_NUMERICSERV) != 0)
    throw std::runtime_error("cannot tell the address that is listened on");
  const std::string name = address.ss_family == AF_INET6 ? '[' + std::string(host) + ']' : host;
  return name + ':' + port;
}

std::string url_of(const FileDescriptor& listening, bool is_tls) {
  return (is_tls ? "https://" : "http://") + address_of(listening.value());
}

}  // namespace tessera::server
