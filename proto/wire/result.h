#pragma once

#include <utility>
#include <variant>

#include "proto/wire/problem.h"

namespace tessera::proto {

/// A value, or the problem that stands in its way.
template <typename T>
class Result {
 public:
  Result(T value) : outcome_(std::move(value)) {}
  Result(Problem problem) : outcome_(std::move(problem)) {}

  explicit operator bool() const { return outcome_.index() == 0; }
  T& operator*() & { return std::get<0>(outcome_); }
  const T& operator*() const& { return std::get<0>(outcome_); }
  T&& operator*() && { return std::get<0>(std::move(outcome_)); }
  T* operator->() { return &std::get<0>(outcome_); }
  const T* operator->() const { return &std::get<0>(outcome_); }

  /// Precondition: there is no value.
  const Problem& problem() const { return std::get<1>(outcome_); }

 private:
  std::variant<T, Problem> outcome_;
};

}  // namespace tessera::proto
