#include "server/http/response_head.h"

#include <algorithm>
#include <cstddef>
#include <ctime>
#include <iterator>
#include <string_view>

namespace tessera::server {
namespace {

constexpr std::size_t kUsualLength = 512;

/// Now. Written once a second by each thread, for all the answers that it gives then.
std::string_view http_date() {
  thread_local std::time_t written = -1;
  thread_local char text[64];
  thread_local std::size_t length = 0;
  const std::time_t now = std::time(nullptr);
  if (now != written) {
    std::tm parts{};
    gmtime_r(&now, &parts);
    length = std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &parts);
    written = now;
  }
  return {text, length};
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
  std::string text;
  text.reserve(kUsualLength);
  text += "HTTP/1.1 " + std::to_string(response.status) + ' ';
  text += reason(response.status);
  text += "\r\nServer: tessera/" TESSERA_VERSION "\r\nDate: ";
  text += http_date();
  text += "\r\n";
  for (const auto& [name, value] : response.headers) ((text += name) += ": ").append(value) += "\r\n";
  if (response.stream && minor_version > 0) text += "Transfer-Encoding: chunked\r\n";
  if (!is_bare(response) && response.has_length && !response.stream)
    text += "Content-Length: " + std::to_string(response.content().size()) + "\r\n";
  if (!keeps_connection) text += "Connection: close\r\n";
  if (keeps_connection && minor_version == 0) text += "Connection: keep-alive\r\n";
  text += "\r\n";
  return text;
}

}  // namespace tessera::server
