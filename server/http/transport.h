#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include <sys/socket.h>
#include <sys/types.h>

#include "server/http/tls_context.h"

namespace tessera::server {

/// The bytes of one connection as HTTP has them: those of its socket, or what TLS makes of them. Nothing here waits,
/// and the handshake takes place in the first calls of `receive`. Belongs to the thread of the socket's loop.
class Transport {
 public:
  /// TLS where there is a context for it. Throws std::bad_alloc.
  Transport(int socket, const TlsContext* tls) : socket_(socket), tls_(tls ? tls->accept(socket) : TlsState()) {}

  /// As recv(2): how many bytes have come, 0 when no more will, or -1 with `errno`. EAGAIN: not before the socket has
  /// changed; EINTR: perhaps at the next call.
  ssize_t receive(std::span<char> room) {
    return tls_ ? receive_decrypted(room) : ::recv(socket_, room.data(), room.size(), 0);
  }

  /// How many bytes of the two, one after the other, have been sent, or -1 with `errno`. After EAGAIN nothing may be
  /// sent but these.
  ssize_t send(std::string_view first, std::string_view second) {
    return tls_ ? send_encrypted(first, second) : send_plainly(first, second);
  }

  /// Sends a few bytes now or not at all. False when a part of them is gone, and nothing can follow.
  bool send_at_once(std::string_view bytes);

  /// Says that nothing more will be sent. What still comes isn't looked at from then on: `receive` gives it as it is.
  /// False when that has to be tried again once the socket has changed.
  bool finish();

  /// The client began with a request where a TLS handshake belongs. All goes on as it came, without TLS, so that it can
  /// be told.
  bool lacks_tls() const { return lacks_tls_; }

 private:
  ssize_t send_plainly(std::string_view first, std::string_view second);
  ssize_t receive_decrypted(std::span<char> room);
  ssize_t send_encrypted(std::string_view first, std::string_view second);
  ssize_t outcome_of(int result);

  const int socket_;
  TlsState tls_;            ///< None: plain bytes.
  unsigned fruitless_ = 0;  ///< Calls of `receive` in a row that something came for, and no byte of HTTP.
  bool has_begun_ = false, has_failed_ = false, lacks_tls_ = false;
};

}  // namespace tessera::server
