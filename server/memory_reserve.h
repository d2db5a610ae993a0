#pragma once

#include <cstddef>

namespace tessera::server {

/// Memory that is set aside for answers, so that what there is no way to fail in finds some where the rest has run out:
/// nlohmann::json, for one, allocates when it is destroyed. The program's operator new draws on it for small objects,
/// in threads that may, after malloc has failed.
class MemoryReserve {
 public:
  /// While one lives, its thread may draw its share; and as much again while an exception unwinds the stack.
  class Share {
   public:
    Share() noexcept;
    ~Share();
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;
  };

  /// Sets aside again what was drawn, as far as there is memory. For any thread.
  static void refill() noexcept;

  /// Whether malloc may now find so many bytes that it didn't before: operator new asks.
  static bool give(std::size_t bytes) noexcept;
};

}  // namespace tessera::server
