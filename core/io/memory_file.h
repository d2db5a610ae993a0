#pragma once

#include <cstddef>
#include <new>
#include <utility>
#include <vector>

namespace tessera {

/// A file in memory that a C library writes to: through C no exception may pass.
class MemoryFile {
 public:
  /// False, and from then on, when memory has run out.
  bool append(const void* data, std::size_t count) noexcept {
    try {
      const auto* first = static_cast<const std::byte*>(data);
      bytes_.insert(bytes_.end(), first, first + count);
    } catch (const std::bad_alloc&) {
      out_of_memory_ = true;
    }
    return !out_of_memory_;
  }

  bool out_of_memory() const { return out_of_memory_; }
  std::vector<std::byte> take() && { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
  bool out_of_memory_ = false;
};

}  // namespace tessera
