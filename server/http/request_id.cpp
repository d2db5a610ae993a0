#include "server/http/request_id.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <random>

namespace tessera::server {
namespace {

constexpr std::size_t kMostIdBytes = 128;
constexpr std::string_view kIdCharacters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~:/+=@";

bool is_request_id(std::string_view text) {
  return !text.empty() && text.size() <= kMostIdBytes && text.find_first_not_of(kIdCharacters) == text.npos;
}

bool is_problem(const Response& response) {
  return std::ranges::any_of(response.headers, [](const auto& header) {
    return header.first == "Content-Type" && header.second == "application/problem+json";
  });
}

}  // namespace

std::string request_id(std::optional<std::string_view> given) {
  if (given && is_request_id(*given)) return std::string(*given);
  static const std::uint64_t process = std::uint64_t{std::random_device()()} << 32 | std::random_device()();
  static std::atomic<std::uint64_t> count{0};
  char text[40];
  std::snprintf(text, sizeof text, "%016llx-%llx", static_cast<unsigned long long>(process),
                static_cast<unsigned long long>(++count));
  return text;
}

void add_request_id(Response& response, const std::string& id) {
  response.headers.emplace_back("X-Request-Id", id);
  if (!is_problem(response)) return;
  const std::size_t end = response.body.rfind('}');
  if (end != std::string::npos) response.body.insert(end, ",\"request_id\":\"" + id + '"');
}

}  // namespace tessera::server
