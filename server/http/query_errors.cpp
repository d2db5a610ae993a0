#include "server/http/query_errors.h"

#include <utility>

namespace tessera::server {

void QueryErrors::add(std::string_view name, std::string detail) {
  if (errors_.size() < proto::kMaxFieldErrors) errors_.push_back({"?" + std::string(name), std::move(detail)});
}

proto::Problem QueryErrors::as_problem() && {
  return {proto::ProblemCode::malformed_request, "The query parameters can't be used; `errors` says why.",
          std::move(errors_)};
}

}  // namespace tessera::server
