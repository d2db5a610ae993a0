#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace tessera::client {

/// Where a server listens.
struct ServerAddress {
  std::string host = "127.0.0.1";
  std::string port = "8080";
  bool is_tls = false;
  std::filesystem::path ca_file{};  ///< PEM, of who vouches for its certificate; empty for whom the system trusts.
};

/// Reads "http://host[:port][/]" or the same with https, host possibly an IPv6 address in brackets; the port defaults
/// to 80, or 443. Nothing for anything else.
std::optional<ServerAddress> parse_server_url(std::string_view url);

/// "http://host:port", or with https.
std::string to_url(const ServerAddress& address);

/// `text` as one segment of a path or one value of a query (RFC 3986).
std::string percent_encode(std::string_view text);

struct HttpRequest {
  std::string method;  ///< "GET", "PUT", ...
  std::string target;  ///< Path and query, encoded.
  std::string content_type{};
  std::variant<std::string, std::filesystem::path> body{};  ///< A path streams that file.
  std::string key{};                                        ///< Shown to the server; empty for none.
};

struct HttpResponse {
  unsigned status = 0;
  std::string retry_after;
  std::string body;
  std::string date{};
  std::optional<std::chrono::sys_seconds> certificate_expires{};  ///< That the server showed.
};

/// Sends one request over a connection of its own and waits for the answer, of any status. A file is sent only once
/// the server asks for it (Expect: 100-continue), so that one it knows or refuses isn't sent for nothing. Throws
/// `Failure` (unreachable, untrusted, local_file). Safe to call from any number of threads.
HttpResponse exchange(const ServerAddress& address, HttpRequest request);

/// The same for a request without a body; the body of an answer of status 200 is handed over as it comes, and isn't in
/// what is returned at its end.
HttpResponse exchange(const ServerAddress& address, const HttpRequest& request,
                      const std::function<void(std::string_view)>& on_piece);

}  // namespace tessera::client
