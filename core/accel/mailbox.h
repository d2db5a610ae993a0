#pragma once

#include <array>
#include <cstdint>

namespace tessera {

/// Remembers the items that a visit met last, so that one which lies in several cells is seldom tested twice. Forgets
/// when two items share a slot: testing again is never wrong. (Inverse mailboxing: Shevtsov, Soupikov & Kapustin 2007.)
class Mailbox {
 public:
  Mailbox() { recent_.fill(kNone); }

  /// False the first time; after that true, as long as it is remembered.
  bool met(std::uint32_t item) {
    std::uint32_t& slot = recent_[item % recent_.size()];
    if (slot == item) return true;
    slot = item;
    return false;
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  std::array<std::uint32_t, 16> recent_;
};

}  // namespace tessera
