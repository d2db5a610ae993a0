#include "server/store/storage_error.h"

#include <cerrno>

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

void throw_storage_error(const std::string& what) { throw StorageError(errno, what); }

Problem storage_problem(const std::error_code& error) {
  const int number = error.value();
  if (number == ENOSPC || number == EDQUOT || number == EFBIG)
    return {ProblemCode::insufficient_storage, "There is no room for this on the server's disk.", {}};
  return {ProblemCode::storage_unavailable, "The server can't use its data folder: " + error.message() + '.', {}};
}

}  // namespace tessera::server
