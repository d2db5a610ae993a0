#include "proto/parse.h"

#include <exception>
#include <new>
#include <system_error>
#include <utility>

#include "proto/file_loader.h"
#include "proto/job_parser.h"
#include "proto/json_cursor.h"
#include "proto/json_document.h"
#include "proto/scene_parser.h"

namespace tessera::proto {
namespace {

/// The one way from bytes to a document's value. `read` is `read_scene` or `read_job`.
template <typename T, typename Read>
Result<T> parse(std::string_view bytes, std::string_view what, const FileSource& files, const Limits& limits,
                const std::stop_token& stop, Read read) try {
  throw_if_abandoned(stop);
  FieldErrors errors(stop);
  const auto document = JsonDocument::parse(bytes, limits.max_depth, errors);
  if (!document) return document.problem();
  std::optional<T> value = read(JsonCursor(*document, errors), files, limits);
  if (!value) return std::move(errors).as_problem(what);
  return *std::move(value);
} catch (const Abandoned&) {
  throw;
} catch (NoFaultOfTheDocument& fault) {
  return std::move(fault.problem);
} catch (const std::system_error&) {  // The files' own, not the document's.
  throw;
} catch (const std::bad_alloc&) {
  return Problem{ProblemCode::out_of_memory_budget,
                 "There is not enough memory for the " + std::string(what) + "; try again later, or send less.",
                 {}};
} catch (const std::exception& e) {
  return Problem{ProblemCode::internal_error, "The " + std::string(what) + " could not be read: " + e.what(), {}};
}

}  // namespace

Result<ParsedScene> parse_scene(std::string_view bytes, const FileSource& files, const Limits& limits,
                                std::stop_token stop) {
  return parse<ParsedScene>(bytes, "scene document", files, limits, stop, read_scene);
}

Result<JobRequest> parse_job(std::string_view bytes, const FileSource& files, const Limits& limits,
                             std::stop_token stop) {
  return parse<JobRequest>(bytes, "job document", files, limits, stop, read_job);
}

}  // namespace tessera::proto
