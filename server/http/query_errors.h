#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/problem.h"

namespace tessera::server {

/// What is wrong with the query parameters of a request, collected.
class QueryErrors {
 public:
  /// Beyond `kMaxFieldErrors`, more are left away.
  void add(std::string_view name, std::string detail);
  bool empty() const { return errors_.empty(); }

  /// `malformed_request` with all of them.
  proto::Problem as_problem() &&;

 private:
  std::vector<proto::FieldError> errors_;
};

}  // namespace tessera::server
