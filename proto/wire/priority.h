#pragma once

#include <span>

#include "proto/wire/choice.h"

namespace tessera::proto {

/// How urgent a job is, beside others of the same owner.
enum class Priority { low, normal, high };

inline std::span<const Choice<Priority>> priority_names() {
  static constexpr Choice<Priority> table[] = {
      {"low", Priority::low}, {"normal", Priority::normal}, {"high", Priority::high}};
  return table;
}

}  // namespace tessera::proto
