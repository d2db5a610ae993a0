/* Preloaded into the daemon: kills it at the TESSERA_FAULT_POINT-th moment before or after a call that changes what
 * lies on disk. So a kill meets the moments between write, sync, rename and unlink, and not only those between
 * requests. Files alone count, and not the log. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static atomic_long left;

__attribute__((constructor)) static void read_point(void) {
  const char* point = getenv("TESSERA_FAULT_POINT");
  left = point ? atol(point) : 0;
}

static void moment(void) {
  if (atomic_load(&left) > 0 && atomic_fetch_sub(&left, 1) == 1) kill(getpid(), SIGKILL);
}

static int is_file(int fd) {
  struct stat status;
  return fd > 2 && fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
}

#define AROUND(type, name, parameters, arguments, counts) \
  type name parameters {                                  \
    static type(*next) parameters;                        \
    if (!next) *(void**)&next = dlsym(RTLD_NEXT, #name);  \
    const int is_counted = counts;                        \
    if (is_counted) moment();                             \
    const type result = next arguments;                   \
    if (is_counted) moment();                             \
    return result;                                        \
  }

AROUND(ssize_t, write, (int fd, const void* from, size_t count), (fd, from, count), is_file(fd))
AROUND(ssize_t, pwrite, (int fd, const void* from, size_t count, off_t at), (fd, from, count, at), is_file(fd))
AROUND(ssize_t, pwrite64, (int fd, const void* from, size_t count, off64_t at), (fd, from, count, at), is_file(fd))
AROUND(int, fsync, (int fd), (fd), 1)
AROUND(int, fdatasync, (int fd), (fd), 1)
AROUND(int, ftruncate, (int fd, off_t size), (fd, size), 1)
AROUND(int, ftruncate64, (int fd, off64_t size), (fd, size), 1)
AROUND(int, rename, (const char* from, const char* to), (from, to), 1)
AROUND(int, renameat, (int from_fd, const char* from, int to_fd, const char* to), (from_fd, from, to_fd, to), 1)
AROUND(int, link, (const char* from, const char* to), (from, to), 1)
AROUND(int, unlink, (const char* path), (path), 1)
AROUND(int, unlinkat, (int fd, const char* path, int flags), (fd, path, flags), 1)
