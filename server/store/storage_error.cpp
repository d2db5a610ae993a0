#include "server/store/storage_error.h"

#include <cerrno>

#include <spdlog/spdlog.h>

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

void throw_storage_error(const std::string& what) { throw StorageError(errno, what); }

Problem refuse(const StorageError& error) {
  spdlog::error("{}", error.what());
  const int number = error.code().value();
  if (number == ENOSPC || number == EDQUOT || number == EFBIG)
    return {ProblemCode::insufficient_storage, "There is no room for this on the server's disk.", {}};
  return {
      ProblemCode::storage_unavailable, "The server can't use its data folder: " + error.code().message() + '.', {}};
}

}  // namespace tessera::server
