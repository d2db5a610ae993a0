#pragma once

#include <cstddef>
#include <memory>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

#include "core/accel/wide/cache_lines.h"

namespace tessera {

/// Whether most of an array will be written to, or only stretches here and there.
enum class Filling { dense, sparse };

/// Uninitialised memory for objects that need neither constructor nor destructor, from a cache line on. Pages that are
/// never written to take no memory. Large arrays ask for huge ones where there are such: rays that go anywhere in a
/// tree otherwise wait for the page table as often as for the tree. Sparse ones ask for small ones.
template <typename T>
class RawArray {
 public:
  explicit RawArray(std::size_t count, Filling filling = Filling::dense) {
    const std::size_t bytes = count * sizeof(T), align = bytes < 2 * kHugePage ? kCacheLine : kHugePage;
    data_ = {static_cast<T*>(::operator new (bytes, std::align_val_t{align})), Free{align}};
#ifdef __linux__
    const int wish = filling == Filling::dense ? MADV_HUGEPAGE : MADV_NOHUGEPAGE;  // which may fail
    if (align == kHugePage) madvise(data_.get(), bytes / kHugePage * kHugePage, wish);
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
