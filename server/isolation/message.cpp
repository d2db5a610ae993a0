#include "server/isolation/message.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include <sys/socket.h>

namespace tessera::server {

std::pair<FileDescriptor, FileDescriptor> make_channel() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw std::system_error(errno, std::generic_category(), "cannot make a channel between processes");
  return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

namespace {

bool send(int channel, std::uint32_t kind, std::string_view body, std::span<const int> files, int flags) {
  if (body.size() > kLongestBody || files.size() > kMostFilesSent) throw std::logic_error("a message is too long");
  std::array<iovec, 2> pieces{{{&kind, sizeof(kind)}, {const_cast<char*>(body.data()), body.size()}}};
  msghdr message{};
  message.msg_iov = pieces.data();
  message.msg_iovlen = pieces.size();
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(kMostFilesSent * sizeof(int))> control{};
  if (!files.empty()) {
    message.msg_control = control.data();
    message.msg_controllen = CMSG_SPACE(files.size_bytes());
    cmsghdr* const header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(files.size_bytes());
    std::memcpy(CMSG_DATA(header), files.data(), files.size_bytes());
  }
  ssize_t sent = 0;
  do sent = ::sendmsg(channel, &message, MSG_NOSIGNAL | flags);
  while (sent < 0 && errno == EINTR);
  return sent >= 0;
}

}  // namespace

bool send_message(int channel, std::uint32_t kind, std::string_view body, std::span<const int> files) {
  return send(channel, kind, body, files, 0);
}

bool try_to_send_message(int channel, std::uint32_t kind, std::string_view body) {
  return send(channel, kind, body, {}, MSG_DONTWAIT);
}

std::optional<Message> receive_message(int channel) {
  Message received;
  std::string bytes(sizeof(received.kind) + kLongestBody, '\0');
  iovec piece{bytes.data(), bytes.size()};
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(kMostFilesSent * sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &piece;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ssize_t got = 0;
  do got = ::recvmsg(channel, &message, MSG_CMSG_CLOEXEC);
  while (got < 0 && errno == EINTR);
  if (got < 0) return std::nullopt;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) continue;
    for (std::size_t at = CMSG_LEN(0); at + sizeof(int) <= header->cmsg_len; at += sizeof(int)) {
      int file = -1;
      std::memcpy(&file, reinterpret_cast<const std::byte*>(header) + at, sizeof(file));
      received.files.emplace_back(file);
    }
  }
  if (static_cast<std::size_t>(got) < sizeof(received.kind) || (message.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) != 0)
    return std::nullopt;
  std::memcpy(&received.kind, bytes.data(), sizeof(received.kind));
  received.body.assign(bytes, sizeof(received.kind), static_cast<std::size_t>(got) - sizeof(received.kind));
  return received;
}

}  // namespace tessera::server
