#pragma once

#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/wire/abandoned.h"
#include "proto/wire/problem.h"

namespace tessera::proto {

/// What is wrong with a document, in the order of finding: the first `kMaxFieldErrors`. Further ones are dropped,
/// so a reader may go on after an error, and a long loop should stop once the list is full. Every reader has them at
/// hand, so they also count its steps.
class FieldErrors {
 public:
  explicit FieldErrors(std::stop_token stop = {}) : steps_(std::move(stop)) {}

  void add(std::string pointer, std::string detail) {
    if (!full()) list_.push_back({std::move(pointer), std::move(detail)});
  }
  bool empty() const { return list_.empty(); }
  bool full() const { return list_.size() >= kMaxFieldErrors; }
  std::size_t size() const { return list_.size(); }

  Steps& steps() { return steps_; }

  /// The refusal of `document`, say "scene document". Precondition: not empty.
  Problem as_problem(std::string_view document) &&;

 private:
  std::vector<FieldError> list_;
  Steps steps_;
};

/// A text of the user's as it may stand in a sentence: in quotes, cut where it is long.
std::string in_quotes(std::string_view text);

/// A key as a part of a JSON pointer (RFC 6901), with its slash. A key that is absurdly long is cut: the pointer
/// then names the place to a reader, though not to a program.
std::string pointer_part(std::string_view key);

}  // namespace tessera::proto
