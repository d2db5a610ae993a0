#pragma once

#include <algorithm>
#include <span>
#include <string_view>

namespace tessera::proto {

/// A word on the wire, and what it means.
template <typename T>
struct Choice {
  std::string_view name;
  T value;
};

/// The word for `value`. Precondition: it is among the choices.
template <typename T>
std::string_view name_of(std::span<const Choice<T>> choices, T value) {
  return std::ranges::find(choices, value, &Choice<T>::value)->name;
}

}  // namespace tessera::proto
