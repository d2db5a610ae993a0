#include "server/http/authorization.h"

#include <string>

#include "server/http/key_ring.h"
#include "server/jobs/quotas.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

constexpr const char* kChallenge = "Bearer realm=\"tessera\"";

Response challenge(const Problem& problem, const std::string& why) {
  Response response = problem_response(problem);
  response.headers.emplace_back("WWW-Authenticate", kChallenge + why);
  return response;
}

}  // namespace

std::optional<Response> refuse_stranger(Services& services, const Route& route, Request& request) {
  if (!route.needs) return std::nullopt;
  const auto authorization = request.header("authorization");
  auto found = services.keys.find(authorization);
  if (!found) return challenge(found.problem(), authorization ? ", error=\"invalid_token\"" : "");
  request.who = *std::move(found);
  if (request.who.may(*route.needs)) {
    if (!request.who.key) return std::nullopt;
    const auto refused = services.quotas.take_request(*request.who.key);
    return refused ? std::optional(problem_response(*refused)) : std::nullopt;
  }
  const std::string scope(proto::name_of(proto::scope_names(), *route.needs));
  return challenge({ProblemCode::forbidden, "The key " + request.who.key->id + " lacks the scope " + scope + ".", {}},
                   ", error=\"insufficient_scope\", scope=\"" + scope + '"');
}

void tell_quota(Services& services, const Request& request, Response& response) {
  if (!request.who.key) return;
  const auto requests = services.quotas.requests(*request.who.key);
  if (!requests) return;
  response.headers.emplace_back("RateLimit-Limit", std::to_string(requests->limit));
  response.headers.emplace_back("RateLimit-Remaining", std::to_string(requests->remaining));
  response.headers.emplace_back("RateLimit-Reset", std::to_string(requests->to_limit.count()));
}

}  // namespace tessera::server
