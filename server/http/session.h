#pragma once

#include <atomic>
#include <cstdint>

#include "server/http/event_loop.h"
#include "server/http/lane.h"
#include "server/http/task.h"
#include "server/services.h"
#include "server/store/file_descriptor.h"

namespace tessera::server {

class TlsContext;

/// What all connections share.
struct Connections {
  Services& services;
  Lane& quick;                                 ///< For work that is bounded, so that it never waits long.
  Lane& slow;                                  ///< For all other work that isn't for I/O threads.
  const TlsContext* tls = nullptr;             ///< Where connections speak TLS.
  std::atomic<std::uint32_t> open{0};          ///< Connections that there are.
  std::atomic<int> requests_active{0};         ///< Header read, response not written yet.
  std::atomic<std::uint32_t> streams{0};       ///< Connections that stream.
  std::atomic<std::uint64_t> body_bytes{0};    ///< Of bodies that connections hold in memory.
  std::atomic<std::uint64_t> answer_bytes{0};  ///< Of encoded images that are being sent.
};

/// Serves HTTP/1.1 (RFC 9110, 9112) on one connection, request after request, until either side closes it. No exception
/// leaves it: where memory runs out, the request is refused, or the connection closed.
Detached serve(EventLoop& loop, FileDescriptor socket, Connections& connections);

}  // namespace tessera::server
