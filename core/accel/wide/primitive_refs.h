#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

#include "core/accel/wide/lanes.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

/// A triangle, or a part of one, as builders know it: its box, and in the fourth lane of `hi` its number
/// (less than 2^30).
struct PrimitiveRef {
  /// Keeps the fourth lane a normal number: arithmetic on denormal ones is slow on some machines.
  static constexpr std::uint32_t kTag = 1U << 30;

  Lanes lo, hi;

  static PrimitiveRef of(const LanesBox& box, std::uint32_t triangle) {
    PrimitiveRef ref{box.lo, box.hi};
    ref.lo[3] = 0;
    ref.hi[3] = std::bit_cast<float>(triangle | kTag);
    return ref;
  }
  std::uint32_t triangle() const { return std::bit_cast<std::uint32_t>(hi[3]) & ~kTag; }
  /// Twice its box's middle.
  Lanes middle() const { return lo + hi; }
  LanesBox box() const { return {lo, hi}; }
};

/// Uninitialised memory for plain objects: pages that are never written to take none.
template <typename T>
class Scratch {
 public:
  explicit Scratch(std::size_t count) : data_(static_cast<T*>(::operator new(count * sizeof(T), kAlign))) {}
  T* data() const { return data_.get(); }
  T& operator[](std::size_t i) const { return data_.get()[i]; }

 private:
  static constexpr std::align_val_t kAlign{64};
  struct Free {
    void operator()(T* data) const { ::operator delete(data, kAlign); }
  };
  std::unique_ptr<T, Free> data_;
};

}  // namespace tessera
