#include "server/service_manager.h"

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

namespace tessera::server {
namespace {

std::optional<std::uint64_t> number_of(const char* variable) {
  const char* text = std::getenv(variable);
  std::uint64_t number = 0;
  if (!text) return std::nullopt;
  const char* end = text + std::strlen(text);
  const auto [read, error] = std::from_chars(text, end, number);
  return error == std::errc() && read == end ? std::optional(number) : std::nullopt;
}

}  // namespace

ServiceManager::ServiceManager() {
  const char* address = std::getenv("NOTIFY_SOCKET");
  const bool is_one = address && (address[0] == '/' || address[0] == '@') && address[1] != '\0';
  if (!is_one || std::strlen(address) >= sizeof(sockaddr_un::sun_path)) return;
  address_ = address;
  if (address_.front() == '@') address_.front() = '\0';  // Of Linux's abstract names.
  socket_ = FileDescriptor(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const timeval patience{1, 0};
  ::setsockopt(socket_.value(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  const auto interval = number_of("WATCHDOG_USEC"), process = number_of("WATCHDOG_PID");
  if (interval && *interval > 0 && (!process || *process == static_cast<std::uint64_t>(::getpid())))
    watchdog_ = std::chrono::microseconds(*interval);
}

void ServiceManager::tell(std::string_view state) const noexcept { send(state, 0); }

void ServiceManager::tell_alive() const noexcept { send("WATCHDOG=1", MSG_DONTWAIT); }

void ServiceManager::send(std::string_view state, int flags) const noexcept {
  if (address_.empty() || !socket_) return;
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  std::memcpy(to.sun_path, address_.data(), address_.size());
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  ::sendto(socket_.value(), state.data(), state.size(), MSG_NOSIGNAL | flags, reinterpret_cast<sockaddr*>(&to), size);
}

void ServiceManager::tell_reloading() const noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  char text[64];
  const int size = std::snprintf(text, sizeof text, "RELOADING=1\nMONOTONIC_USEC=%lld",
                                 static_cast<long long>(now.tv_sec) * 1'000'000 + now.tv_nsec / 1000);
  tell({text, static_cast<std::size_t>(size)});
}

}  // namespace tessera::server
