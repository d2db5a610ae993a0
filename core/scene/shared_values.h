#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace tessera {

/// Numbers that don't change, wherever they lie; copies share them. Safe to read from any number of threads.
template <typename T>
class SharedValues {
 public:
  using value_type = T;
  using const_iterator = const T*;

  SharedValues() = default;
  SharedValues(std::vector<T> values) {
    const auto kept = std::make_shared<const std::vector<T>>(std::move(values));
    values_ = *kept;
    hold_ = kept;
  }
  /// They stay where they are as long as `hold` lives.
  SharedValues(std::span<const T> values, std::shared_ptr<const void> hold) : values_(values), hold_(std::move(hold)) {}

  const T& operator[](std::size_t i) const { return values_[i]; }
  std::size_t size() const { return values_.size(); }
  const T* begin() const { return values_.data(); }
  const T* end() const { return values_.data() + values_.size(); }
  std::span<const T> span() const { return values_; }

  friend bool operator==(const SharedValues& a, const SharedValues& b) { return std::ranges::equal(a, b); }

 private:
  std::span<const T> values_;
  std::shared_ptr<const void> hold_;
};

}  // namespace tessera
