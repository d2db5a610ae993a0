#include "server/http/transport.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <iterator>

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/uio.h>

namespace tessera::server {
namespace {

/// Most bytes of one record (RFC 8446, 5.1).
constexpr std::size_t kRecordBytes = 16 << 10;

/// So often in a row a peer may send what holds nothing for HTTP.
constexpr unsigned kMostFruitless = 256;

/// How a request line begins, and no TLS record does (RFC 8446, B.1).
bool begins_method(char c) { return c >= 'A' && c <= 'Z'; }

}  // namespace

bool Transport::send_at_once(std::string_view bytes) {
  if (!tls_) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return sent <= 0 || static_cast<std::size_t>(sent) == bytes.size();
  }
  // A record that is begun has to be gone on with: so none is where it may not fit. Where poll(2) sees room, there is
  // enough for a few bytes.
  pollfd room{socket_, POLLOUT, 0};
  if (!SSL_is_init_finished(tls_.get()) || ::poll(&room, 1, 0) != 1 || (room.revents & POLLOUT) == 0) return true;
  return send_encrypted(bytes, {}) == static_cast<ssize_t>(bytes.size());
}

bool Transport::finish() {
  if (tls_ && !has_failed_ && SSL_is_init_finished(tls_.get())) {
    ERR_clear_error();
    if (const int result = SSL_shutdown(tls_.get()); result < 0)  // close_notify (RFC 8446, 6.1)
      if (outcome_of(result) < 0 && errno == EAGAIN) return false;
  }
  tls_.reset();
  ::shutdown(socket_, SHUT_WR);
  return true;
}

ssize_t Transport::send_plainly(std::string_view first, std::string_view second) {
  iovec pieces[] = {{const_cast<char*>(first.data()), first.size()}, {const_cast<char*>(second.data()), second.size()}};
  msghdr message{};
  message.msg_iov = pieces;
  message.msg_iovlen = std::size(pieces);
  return ::sendmsg(socket_, &message, MSG_NOSIGNAL);
}

ssize_t Transport::receive_decrypted(std::span<char> room) {
  if (!has_begun_) {
    char first = 0;
    const ssize_t count = ::recv(socket_, &first, 1, MSG_PEEK);
    if (count <= 0) return count;
    has_begun_ = true;
    if (begins_method(first)) {
      lacks_tls_ = true;
      tls_.reset();
      return receive(room);
    }
  }
  ERR_clear_error();
  const int result = SSL_read(tls_.get(), room.data(), static_cast<int>(std::min(room.size(), kRecordBytes)));
  const ssize_t count = outcome_of(result);
  if (count < 0 && errno == EAGAIN && SSL_want_read(tls_.get())) {
    // It may have stopped at a record that held nothing for HTTP, and the socket won't change for what is there
    // already.
    char next = 0;
    errno = ::recv(socket_, &next, 1, MSG_PEEK) < 0 ? EAGAIN : ++fruitless_ <= kMostFruitless ? EINTR : ECONNABORTED;
  }
  if (count > 0) fruitless_ = 0;
  return count;
}

ssize_t Transport::send_encrypted(std::string_view first, std::string_view second) {
  // A head and the beginning of its body are one record and one packet.
  std::array<char, kRecordBytes> together;
  std::string_view next = first.empty() ? second : first;
  if (!first.empty() && first.size() < together.size() && !second.empty()) {
    const std::size_t rest = std::min(second.size(), together.size() - first.size());
    std::ranges::copy(second.substr(0, rest), std::ranges::copy(first, together.begin()).out);
    next = {together.data(), first.size() + rest};
  }
  ERR_clear_error();
  const ssize_t sent =
      outcome_of(SSL_write(tls_.get(), next.data(), static_cast<int>(std::min(next.size(), kRecordBytes))));
  if (sent == 0) errno = EPIPE;
  return sent == 0 ? -1 : sent;
}

ssize_t Transport::outcome_of(int result) {
  if (result > 0) return result;
  switch (SSL_get_error(tls_.get(), result)) {
    case SSL_ERROR_ZERO_RETURN:
      return 0;
    case SSL_ERROR_WANT_READ:
    case SSL_ERROR_WANT_WRITE:
      errno = EAGAIN;
      return -1;
    default:
      break;
  }
  has_failed_ = true;
  const char* reason = ERR_reason_error_string(ERR_peek_error());
  spdlog::debug("a connection's TLS ends: {}", reason ? reason : "the connection is broken");
  ERR_clear_error();
  errno = ECONNRESET;
  return -1;
}

}  // namespace tessera::server
