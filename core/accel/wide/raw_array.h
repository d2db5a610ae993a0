#pragma once

#include <cstddef>
#include <memory>
#include <new>

namespace tessera {

/// Uninitialised memory for objects that need neither constructor nor destructor, from a cache line on. What is never
/// written to takes no memory.
template <typename T>
class RawArray {
 public:
  explicit RawArray(std::size_t count) : data_(static_cast<T*>(::operator new(count * sizeof(T), kAlign))) {}
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
