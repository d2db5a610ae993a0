#include "server/work/give_way.h"

#include <sys/resource.h>
#include <unistd.h>

namespace tessera::server {
namespace {

/// Enough for those that answer to do so as if nearly nothing else was going on. With more, whatever the machine does
/// beside the server would leave renders hardly anything.
constexpr int kNice = 5;

}  // namespace

void give_way() {
  const auto thread = static_cast<id_t>(::gettid());
  ::setpriority(PRIO_PROCESS, thread, ::getpriority(PRIO_PROCESS, thread) + kNice);
}

}  // namespace tessera::server
