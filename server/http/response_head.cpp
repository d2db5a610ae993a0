#include "server/http/response_head.h"

#include <algorithm>
#include <ctime>
#include <iterator>
#include <string_view>

namespace tessera::server {
namespace {

std::string http_date() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[64];
  return {text, std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &parts)};
}

struct Reason {
  int status;
  std::string_view phrase;
};
constexpr Reason kReasons[] = {{200, "OK"},
                               {201, "Created"},
                               {202, "Accepted"},
                               {204, "No Content"},
                               {206, "Partial Content"},
                               {304, "Not Modified"},
                               {400, "Bad Request"},
                               {401, "Unauthorized"},
                               {403, "Forbidden"},
                               {404, "Not Found"},
                               {405, "Method Not Allowed"},
                               {406, "Not Acceptable"},
                               {408, "Request Timeout"},
                               {409, "Conflict"},
                               {410, "Gone"},
                               {413, "Content Too Large"},
                               {414, "URI Too Long"},
                               {415, "Unsupported Media Type"},
                               {416, "Range Not Satisfiable"},
                               {417, "Expectation Failed"},
                               {421, "Misdirected Request"},
                               {422, "Unprocessable Content"},
                               {429, "Too Many Requests"},
                               {431, "Request Header Fields Too Large"},
                               {500, "Internal Server Error"},
                               {501, "Not Implemented"},
                               {503, "Service Unavailable"},
                               {505, "HTTP Version Not Supported"},
                               {507, "Insufficient Storage"}};

/// Nothing where there is none: nobody needs one (RFC 9112, 4).
std::string_view reason(int status) {
  const auto* const found = std::ranges::find(kReasons, status, &Reason::status);
  return found == std::end(kReasons) ? std::string_view{} : found->phrase;
}

}  // namespace

bool is_bare(const Response& response) { return response.status == 204 || response.status == 304; }

std::string response_head(const Response& response, bool keeps_connection, int minor_version) {
  std::string text = "HTTP/1.1 " + std::to_string(response.status) + ' ';
  text += reason(response.status);
  text += "\r\nServer: tessera/" TESSERA_VERSION "\r\nDate: " + http_date() + "\r\n";
  for (const auto& [name, value] : response.headers) text += name + ": " + value + "\r\n";
  if (response.stream && minor_version > 0) text += "Transfer-Encoding: chunked\r\n";
  if (!is_bare(response) && response.has_length && !response.stream)
    text += "Content-Length: " + std::to_string(response.content().size()) + "\r\n";
  if (!keeps_connection) text += "Connection: close\r\n";
  if (keeps_connection && minor_version == 0) text += "Connection: keep-alive\r\n";
  text += "\r\n";
  return text;
}

}  // namespace tessera::server
