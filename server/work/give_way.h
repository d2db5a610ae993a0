#pragma once

namespace tessera::server {

/// Has the calling thread, which works for long at a time, give way from now on to those that answer: the system lets
/// it have a third of what each of them has where both want to run, and all that they leave (nice(2), which in Linux is
/// each thread's own). Where the system doesn't do so nothing changes.
void give_way();

}  // namespace tessera::server
