#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

#include "core/accel/wide/cache_lines.h"

namespace tessera {

/// Huge ones for what rays read at random ever after: they otherwise wait for the page table as often as for the tree.
/// Small ones for what is soon gone or has holes: where the system has no huge ones left it makes them, and a mesh
/// of 1.6 million triangles waited 0.1 to 0.2 s for those of its builder.
enum class Pages { huge, small };

/// Uninitialised memory for objects that need neither constructor nor destructor, from a cache line on. Pages that are
/// never written to take no memory. Large arrays ask for the pages named, where there are such.
template <typename T>
class RawArray {
 public:
  explicit RawArray(std::size_t count, Pages pages = Pages::huge) {
    const std::size_t bytes = count * sizeof(T), align = bytes < 2 * kHugePage ? kCacheLine : kHugePage;
    data_ = {static_cast<T*>(::operator new (bytes, std::align_val_t{align})), Free{align}};
#ifdef __linux__
    const int wish = pages == Pages::huge ? MADV_HUGEPAGE : MADV_NOHUGEPAGE;  // which may fail
    if (align == kHugePage) madvise(data_.get(), bytes / kHugePage * kHugePage, wish);
#endif
  }

  /// Fetches the pages from item `begin` to `end` at once, which are about to be written to: one by one takes longer.
  void fetch(std::size_t begin, std::size_t end) const {
#if defined(__linux__) && defined(MADV_POPULATE_WRITE)
    constexpr std::uintptr_t kPage = 4096;
    const std::uintptr_t from = reinterpret_cast<std::uintptr_t>(data() + begin) / kPage * kPage;
    const std::uintptr_t to = reinterpret_cast<std::uintptr_t>(data() + end) / kPage * kPage;
    if (from < to) madvise(reinterpret_cast<void*>(from), to - from, MADV_POPULATE_WRITE);  // which may fail
#endif
  }

  T* data() const { return data_.get(); }
  T& operator[](std::size_t i) const { return data_.get()[i]; }

 private:
  static constexpr std::size_t kHugePage = std::size_t{2} << 20;
  struct Free {
    std::size_t align = kCacheLine;
    void operator()(T* data) const { ::operator delete (data, std::align_val_t{align}); }
  };
  std::unique_ptr<T, Free> data_;
};

}  // namespace tessera
