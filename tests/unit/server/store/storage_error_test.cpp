#include "server/store/storage_error.h"

#include <cerrno>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {
using proto::ProblemCode;

TEST(StorageError, IsToldAsWhatItIs) {
  for (const int error : {ENOSPC, EDQUOT, EFBIG})
    EXPECT_EQ(refuse(StorageError(error, "cannot write it")).code, ProblemCode::insufficient_storage);
  for (const int error : {EROFS, ENOENT, EIO, EACCES, EMFILE, ESTALE})
    EXPECT_EQ(refuse(StorageError(error, "cannot open it")).code, ProblemCode::storage_unavailable);
}

}  // namespace
}  // namespace tessera::server
