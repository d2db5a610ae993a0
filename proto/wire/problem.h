#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tessera::proto {

/// Every way in which the service refuses. The table in problem.cpp gives each its name, status and title.
enum class ProblemCode {
  malformed_json,
  malformed_request,
  unauthorized,
  forbidden,
  not_found,
  method_not_allowed,
  not_acceptable,
  request_timeout,
  image_not_ready,
  job_still_active,
  job_already_ended,
  in_use,
  request_in_progress,
  image_gone,
  gone,
  payload_too_large,
  job_too_large,
  target_too_long,
  unsupported_media_type,
  range_not_satisfiable,
  expectation_failed,
  misdirected_request,
  invalid_document,
  hash_mismatch,
  idempotency_key_reused,
  too_many_jobs,
  quota_exceeded,
  headers_too_large,
  out_of_memory_budget,
  not_ready,
  shutting_down,
  storage_unavailable,
  reader_unavailable,
  insufficient_storage,
  not_implemented,
  version_not_supported,
  internal_error,
};

/// A row of the one table of refusals.
struct ProblemEntry {
  ProblemCode code;
  std::string_view name;   ///< On the wire, and the last part of the problem's type URI.
  int status;              ///< HTTP status.
  std::string_view title;  ///< The same for every occurrence (RFC 9457).
  std::string_view help;   ///< For the page that the type URI leads to: what has happened, and what to do.
};
std::span<const ProblemEntry> problem_table();
const ProblemEntry& entry(ProblemCode code);

/// One thing that is wrong with a request, and where.
struct FieldError {
  /// RFC 6901 JSON pointer, "file:line" for an imported file, "?name" for a query parameter, or "{name}" for a part
  /// of the path.
  std::string pointer;
  std::string detail;  ///< What is wrong and how to mend it.
};

/// At most this many field errors are collected for one request.
inline constexpr std::size_t kMaxFieldErrors = 20;

/// A refusal: RFC 9457 problem details.
struct Problem {
  ProblemCode code = ProblemCode::internal_error;
  std::string detail;
  std::vector<FieldError> errors;
  std::optional<std::uint32_t> retry_after =
      std::nullopt;  ///< Seconds until trying again makes sense, where that is known.
};

nlohmann::json to_json(const Problem& problem);

}  // namespace tessera::proto
