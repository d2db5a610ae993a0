#include "server/http/response.h"

#include <string>
#include <utility>

#include <nlohmann/json.hpp>

namespace tessera::server {
namespace {

/// Details may quote what the client sent, and that needn't be UTF-8.
std::string dump(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

bool may_pass(proto::ProblemCode code) {
  return code == proto::ProblemCode::too_many_jobs || code == proto::ProblemCode::out_of_memory_budget ||
         code == proto::ProblemCode::quota_exceeded || code == proto::ProblemCode::not_ready ||
         code == proto::ProblemCode::shutting_down || code == proto::ProblemCode::storage_unavailable ||
         code == proto::ProblemCode::reader_unavailable;
}

}  // namespace

std::string_view Response::content() const {
  const std::string_view all =
      shared_body ? std::string_view(reinterpret_cast<const char*>(shared_body->data()), shared_body->size()) : body;
  return part ? all.substr(part->first, part->second) : all;
}

Response json_response(int status, const nlohmann::json& body) {
  return {status, {{"Content-Type", "application/json"}}, dump(body)};
}

Response json_text_response(int status, std::string text) {
  return {status, {{"Content-Type", "application/json"}}, std::move(text) + '\n'};
}

Response problem_response(const proto::Problem& problem) { return problem_response(problem, nlohmann::json::object()); }

Response problem_response(const proto::Problem& problem, const nlohmann::json& members) {
  nlohmann::json body = proto::to_json(problem);
  body.update(members);
  Response response{proto::entry(problem.code).status, {{"Content-Type", "application/problem+json"}}, dump(body)};
  if (may_pass(problem.code))
    response.headers.emplace_back("Retry-After", std::to_string(problem.retry_after.value_or(1)));
  return response;
}

Response text_response(const proto::Problem& problem) {
  const bool is_theirs = proto::entry(problem.code).status < 500 && !may_pass(problem.code);
  Response response{is_theirs ? 400 : 500, {{"Content-Type", "text/plain; charset=utf-8"}}, ""};
  if (problem.errors.empty()) response.body = problem.detail + '\n';
  for (const proto::FieldError& error : problem.errors) response.body += error.pointer + ": " + error.detail + '\n';
  return response;
}

}  // namespace tessera::server
