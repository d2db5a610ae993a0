#pragma once

#include <functional>

#include <sys/types.h>

#include "server/isolation/worker.h"
#include "server/store/file_descriptor.h"

namespace tessera::server {

/// What a zygote is told; each comes with a file: one end of a channel.
enum class ZygoteHears : std::uint32_t {
  make_worker,  ///< That hears its request there.
  make_zygote,  ///< That has been prepared, and is told things there.
};

/// A zygote, from outside.
struct ZygoteProcess {
  FileDescriptor control;
  pid_t process = -1;
};

/// A process that makes others by fork(2), which takes little time, as it is small; and is safe, as it has one thread:
/// but for those that libraries begin when they are loaded, which wait for work that nobody gives them. It ends with
/// the last who could tell it something, and ends workers whose other end is closed. Gives the channel by which it is
/// told things. Called while the process has one thread. Throws std::system_error.
ZygoteProcess start_zygote(const Work& work, const std::function<void()>& prepare);

}  // namespace tessera::server
