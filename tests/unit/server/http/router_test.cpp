#include "server/http/router.h"

#include <set>
#include <string_view>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/config.h"

namespace tessera::server {
namespace {

Request request_of(std::string method, std::string_view target) {
  Request request;
  request.method = std::move(method);
  request.target = *parse_target(target);
  return request;
}

/// The pattern of the route that was found, or the status of the refusal.
std::string found(Request request) {
  const auto result = find_route(Config{}, request);
  if (const auto* route = std::get_if<const Route*>(&result)) {
    const auto refused = refuse_request(**route, request);
    return refused ? std::to_string(refused->status) : std::string((*route)->pattern);
  }
  return std::to_string(std::get<Response>(result).status);
}

TEST(Router, FindsByMethodAndPath) {
  EXPECT_EQ(found(request_of("GET", "/v1/jobs")), "/v1/jobs");
  EXPECT_EQ(found(request_of("GET", "/v1/jobs/abc")), "/v1/jobs/{id}");
  EXPECT_EQ(found(request_of("POST", "/v1/jobs/abc/cancel")), "/v1/jobs/{id}/cancel");
  EXPECT_EQ(found(request_of("GET", "/v1/jobs/abc/")), "404");
  EXPECT_EQ(found(request_of("GET", "/v1")), "404");
  EXPECT_EQ(found(request_of("GET", "/v1/jobs/abc/image/x")), "404");
}

TEST(Router, HandsOverTheParameter) {
  Request request = request_of("DELETE", "/v1/jobs/a%20b");
  ASSERT_TRUE(std::holds_alternative<const Route*>(find_route(Config{}, request)));
  EXPECT_EQ(request.parameter, "a b");
}

TEST(Router, AHashIsAHash) {
  const std::string hash = "sha256:" + std::string(64, 'a');
  EXPECT_EQ(found(request_of("GET", "/v1/scenes/" + hash)), "/v1/scenes/{hash}");
  EXPECT_EQ(found(request_of("GET", "/v1/scenes/sha256%3A" + hash.substr(7))), "/v1/scenes/{hash}");
  EXPECT_EQ(found(request_of("GET", "/v1/scenes/" + hash + "a")), "404");
  EXPECT_EQ(found(request_of("PUT", "/v1/blobs/" + hash)), "/v1/blobs/{hash}");
  EXPECT_EQ(found(request_of("PUT", "/v1/blobs/" + hash + "a")), "422");
}

TEST(Router, AnotherMethodIsToldWhichThereAre) {
  Request request = request_of("PATCH", "/v1/jobs");
  const auto result = find_route(Config{}, request);
  const Response& response = std::get<Response>(result);
  EXPECT_EQ(response.status, 405);
  EXPECT_EQ(response.headers.back(), std::pair(std::string("Allow"), std::string("POST, GET, HEAD, OPTIONS")));
}

TEST(Router, OptionsAreAnswered) {
  Request request = request_of("OPTIONS", "/v1/jobs");
  auto result = find_route(Config{}, request);
  const Response response = std::get<Response>(result);
  EXPECT_EQ(response.status, 204);
  EXPECT_EQ(response.headers.back().second, "POST, GET, HEAD, OPTIONS");
  EXPECT_EQ(found(request_of("OPTIONS", "/v2")), "404");
  request.target = {};  // The server's.
  result = find_route(Config{}, request);
  EXPECT_EQ(std::get<Response>(result).headers.back().second, "PUT, DELETE, POST, GET, HEAD, OPTIONS");
}

TEST(Router, MethodsThatNoRouteHas) {
  EXPECT_EQ(found(request_of("PATCH", "/v1/jobs")), "405");
  for (const char* method : {"BREW", "CONNECT", "get"}) EXPECT_EQ(found(request_of(method, "/v1/jobs")), "501");
}

TEST(Router, TakesKnownQueryParametersOnceOnly) {
  EXPECT_EQ(found(request_of("GET", "/v1/jobs?limit=1&state=queued")), "/v1/jobs");
  EXPECT_EQ(found(request_of("GET", "/v1/jobs?limit=1&limit=1")), "400");
  EXPECT_EQ(found(request_of("GET", "/livez?limit=1")), "400");
}

TEST(Router, TellsAllThatIsWrongWithTheQuery) {
  Request request = request_of("GET", "/v1/jobs?Limit=1&state=queued&state=failed&limit=1&page=2");
  const Route& route = *std::get<const Route*>(find_route(Config{}, request));
  const auto body = nlohmann::json::parse(refuse_request(route, request)->body);
  std::vector<std::string> pointers;
  for (const auto& error : body["errors"]) pointers.push_back(error["pointer"]);
  EXPECT_EQ(pointers, (std::vector<std::string>{"?Limit", "?state", "?page"}));
}

TEST(Router, DocumentsAreJson) {
  Request request = request_of("POST", "/v1/scenes");
  EXPECT_EQ(found(std::move(request)), "415");
  request = request_of("POST", "/v1/scenes");
  request.headers["content-type"] = "application/json; charset=utf-8";
  EXPECT_EQ(found(std::move(request)), "/v1/scenes");
  request = request_of("POST", "/v1/scenes");
  request.headers = {{"content-type", "application/json"}, {"content-encoding", "gzip"}};
  EXPECT_EQ(found(std::move(request)), "415");
}

TEST(Router, NoRouteStandsThereTwice) {
  std::set<std::pair<std::string_view, std::string_view>> seen;
  for (const Route& route : route_table())
    EXPECT_TRUE(seen.emplace(route.method, route.pattern).second) << route.method << ' ' << route.pattern;
}

TEST(Router, OnlyHealthAndDocumentsAreThereForStrangers) {
  std::set<std::string_view> open;
  for (const Route& route : route_table()) {
    if (!route.needs)
      open.insert(route.pattern);
    else
      EXPECT_EQ(*route.needs, route.method == "GET" ? proto::Scope::read : proto::Scope::submit) << route.pattern;
  }
  EXPECT_EQ(open,
            (std::set<std::string_view>{"/livez", "/readyz", "/openapi.json", "/schemas/", "/schemas/scene.schema.json",
                                        "/schemas/job.schema.json", "/problems/", "/problems/{code}"}));
}

}  // namespace
}  // namespace tessera::server
