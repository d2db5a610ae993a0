#include "server/store/file_hash.h"

#include <cerrno>
#include <span>
#include <vector>

#include <unistd.h>

#include "proto/wire/abandoned.h"
#include "server/store/storage_error.h"

namespace tessera::server {

// Read, not mapped: a mapped file that somebody cuts short ends the process.
proto::ContentHash hash_open_file(int file, std::uint64_t from, const std::stop_token& stop) {
  constexpr std::size_t kPieceOfFile = 256 << 10;
  std::vector<std::byte> piece(kPieceOfFile);
  proto::Sha256 sha256;
  for (;;) {
    proto::throw_if_abandoned(stop);
    const ssize_t count = ::pread(file, piece.data(), piece.size(), static_cast<off_t>(from));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw_storage_error("cannot read a file");
    if (count == 0) return sha256.finish();
    sha256.update(std::span(piece).first(static_cast<std::size_t>(count)));
    from += static_cast<std::uint64_t>(count);
  }
}

}  // namespace tessera::server
