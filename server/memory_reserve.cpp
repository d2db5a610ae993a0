#include "server/memory_reserve.h"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <new>

#include <sys/mman.h>

namespace tessera::server {
namespace {

constexpr std::size_t kChunkBytes = 64 << 10;
constexpr std::size_t kChunks = 256;
constexpr unsigned kShare = 16;  ///< Of a thread, in chunks: there are few threads that have one.
/// Larger objects fail at once: they would take all, and be no answer.
constexpr std::size_t kMostBytes = 32 << 10;

/// Mapped, so that giving one back is of use to every arena of malloc; null where it has been.
std::array<std::atomic<void*>, kChunks> chunks;
std::atomic<std::size_t> missing{kChunks};  ///< Of them, or more for a moment: it is looked at all the time.
thread_local unsigned share = 0, unwinding_share = 0;

/// Gives a chunk back to the system, for malloc to have. False when there is none for this thread.
bool draw() noexcept {
  unsigned& left = share == 0 && std::uncaught_exceptions() > 0 ? unwinding_share : share;
  if (left == 0) return false;
  --left;
  for (auto& chunk : chunks) {
    void* const memory = chunk.exchange(nullptr);
    if (!memory) continue;
    ++missing;
    return ::munmap(memory, kChunkBytes) == 0;
  }
  return false;
}

}  // namespace

MemoryReserve::Share::Share() noexcept { share = unwinding_share = kShare; }

MemoryReserve::Share::~Share() {
  share = unwinding_share = 0;
  refill();
}

void MemoryReserve::refill() noexcept {
  if (missing.load(std::memory_order_relaxed) == 0) return;
  for (auto& chunk : chunks) {
    if (chunk.load(std::memory_order_relaxed)) continue;
    void* const memory = ::mmap(nullptr, kChunkBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) return;
    void* nothing = nullptr;
    if (chunk.compare_exchange_strong(nothing, memory))
      --missing;
    else
      ::munmap(memory, kChunkBytes);
  }
}

bool MemoryReserve::give(std::size_t bytes) noexcept { return bytes <= kMostBytes && draw(); }

}  // namespace tessera::server

void* operator new(std::size_t bytes) {
  for (;;) {
    if (void* const memory = std::malloc(bytes > 0 ? bytes : 1)) return memory;
    if (!tessera::server::MemoryReserve::give(bytes)) throw std::bad_alloc();
  }
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  try {
    return ::operator new(bytes);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
