#include "server/isolation/shared_memory.h"

#include <cerrno>
#include <new>
#include <system_error>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace tessera::server {
namespace {

[[noreturn]] void fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

constexpr std::uint64_t kPage = 1 << 16;  // The largest that systems have; offsets have to be multiples.

std::shared_ptr<std::byte[]> map(int file, std::uint64_t offset, std::size_t bytes, int protection, int sharing) {
  if (bytes == 0) return {};
  const std::uint64_t before = offset % kPage;
  const std::size_t all = bytes + before;
  void* const address = ::mmap(nullptr, all, protection, sharing, file, static_cast<off_t>(offset - before));
  if (address == MAP_FAILED) throw std::bad_alloc();
  return {static_cast<std::byte*>(address) + before, [address, all](std::byte*) { ::munmap(address, all); }};
}

}  // namespace

FileDescriptor make_shared_memory() {
  FileDescriptor memory(::memfd_create("tessera", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!memory || ::fcntl(memory.value(), F_ADD_SEALS, F_SEAL_SHRINK) != 0) fail("cannot make shared memory");
  return memory;
}

FileDescriptor make_shared_memory(std::span<const std::byte> bytes) {
  FileDescriptor memory = make_shared_memory();
  write_all(memory.value(), bytes);
  return memory;
}

bool freeze(const FileDescriptor& memory) {
  return ::fcntl(memory.value(), F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_GROW | F_SEAL_SHRINK | F_SEAL_SEAL) == 0;
}

std::uint64_t size_of(const FileDescriptor& file) {
  const off_t end = ::lseek(file.value(), 0, SEEK_END);
  if (end < 0) fail("cannot tell the size of a file");
  return static_cast<std::uint64_t>(end);
}

void write_all(int file, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail("cannot write to shared memory");
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

std::shared_ptr<const std::byte[]> map_part(int file, std::uint64_t offset, std::size_t bytes) {
  return map(file, offset, bytes, PROT_READ, MAP_PRIVATE);
}

std::shared_ptr<std::byte[]> map_to_write(int memory, std::size_t bytes) {
  if (::ftruncate(memory, static_cast<off_t>(bytes)) != 0) throw std::bad_alloc();
  return map(memory, 0, bytes, PROT_READ | PROT_WRITE, MAP_SHARED);
}

std::vector<std::byte> content_of(const FileDescriptor& memory, std::uint64_t count) {
  std::vector<std::byte> bytes(count);
  for (std::size_t there = 0; there < bytes.size();) {
    const ssize_t got = ::pread(memory.value(), bytes.data() + there, bytes.size() - there, static_cast<off_t>(there));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) fail("cannot read shared memory");
    there += static_cast<std::size_t>(got);
  }
  return bytes;
}

}  // namespace tessera::server
