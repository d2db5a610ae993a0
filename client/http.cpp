#include "client/http.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <vector>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>

#include "client/failure.h"
#include "proto/wire/certificate.h"

namespace tessera::client {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;

constexpr auto kConnectTimeout = std::chrono::seconds(10);
// Between two pieces of a message. Long, for a server may read a big scene's files before it answers.
constexpr auto kIdleTimeout = std::chrono::minutes(5);
constexpr std::uint64_t kPieceBytes = 256 << 10;
constexpr std::string_view kPlainScheme = "http://", kTlsScheme = "https://";

/// A file to be sent, and how much of it.
struct OpenFile {
  beast::file file;
  std::uint64_t size = 0;
};

/// Whom to trust, and with which versions.
asio::ssl::context tls_context(const ServerAddress& address) {
  asio::ssl::context context(asio::ssl::context::tls_client);
  SSL_CTX_set_min_proto_version(context.native_handle(), TLS1_2_VERSION);
  context.set_verify_mode(asio::ssl::verify_peer);
  beast::error_code error;
  if (address.ca_file.empty())
    context.set_default_verify_paths(error);
  else
    context.load_verify_file(address.ca_file.string(), error);
  if (error)
    throw Failure(Failure::Kind::local_file,
                  "no certificates of who is trusted in " + address.ca_file.string() + ": " + error.message());
  return context;
}

/// Why a server's certificate isn't trusted, and what to do.
std::string tell_distrust(long reason) {
  switch (reason) {
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return "its certificate is for another name; call the server by one that stands in it";
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return "its certificate has expired";
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return "its certificate isn't valid yet, or this machine's clock is wrong";
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
      return "nobody who is trusted here vouches for its certificate (" +
             std::string(X509_verify_cert_error_string(reason)) + "); --ca-file names who does";
    default:
      return std::string("its certificate isn't valid: ") + X509_verify_cert_error_string(reason);
  }
}

/// A connection whose blocking calls give up in time: asynchronous operations, waited for one by one.
class Connection {
 public:
  explicit Connection(const ServerAddress& address) : address_(address), stream_(io_) {
    if (address.is_tls) tls_context_.emplace(tls_context(address));
    beast::error_code error;
    asio::ip::tcp::resolver resolver(io_);
    const auto endpoints = resolver.resolve(address.host, address.port, error);
    check(error);
    stream_.expires_after(kConnectTimeout);
    stream_.async_connect(endpoints, [&](beast::error_code e, const auto&) { error = e; });
    finish();
    check(error);
    if (address.is_tls) shake_hands();
  }

  /// Sends the request and returns the answer, which may come before all is sent: a refusal needn't wait for the end.
  HttpResponse exchange(const http::request<http::string_body>& request) {
    http::request_serializer<http::string_body, http::fields> serializer(request);
    send(serializer);
    return receive();
  }

  /// The same, with what comes of a body handed over at once.
  HttpResponse exchange(const http::request<http::empty_body>& request,
                        const std::function<void(std::string_view)>& on_piece) {
    http::request_serializer<http::empty_body, http::fields> serializer(request);
    send(serializer);
    return receive(on_piece);
  }

  /// The same with a file for a body, once the server agrees to it. In large pieces: Beast's own file body sends
  /// 4 KiB at a time, which took nearly half of the client's processor time.
  HttpResponse exchange(const http::request<http::empty_body>& request, OpenFile& body) {
    http::request_serializer<http::empty_body, http::fields> serializer(request);
    send(serializer);
    HttpResponse answer = receive();
    if (answer.status != static_cast<unsigned>(http::status::continue_)) return answer;

    std::vector<char> piece(std::min<std::uint64_t>(kPieceBytes, body.size));
    beast::error_code error;
    for (std::uint64_t left = body.size; left > 0 && !error;) {
      const std::size_t size = body.file.read(piece.data(), std::min<std::uint64_t>(piece.size(), left), error);
      if (error || size == 0) throw Failure(Failure::Kind::local_file, "the file changed while it was sent");
      left -= size;
      for (asio::const_buffer rest(piece.data(), size); rest.size() > 0 && !error;)
        rest += write_some([&](auto& stream, auto done) { stream.async_write_some(rest, done); }, error);
    }
    return receive();
  }

 private:
  using TlsStream = beast::ssl_stream<beast::tcp_stream&>;

  void shake_hands() {
    tls_.emplace(stream_, *tls_context_);
    if (!proto::expect_name(*tls_->native_handle(), address_.host))
      throw Failure(Failure::Kind::untrusted, "'" + address_.host + "' is no name that a certificate could have");
    beast::error_code error;
    tls_->async_handshake(asio::ssl::stream_base::client, [&](beast::error_code e) { error = e; });
    finish();
    if (error && error.category() == asio::error::get_ssl_category()) {
      const long reason = SSL_get_verify_result(tls_->native_handle());
      if (reason != X509_V_OK)
        throw Failure(Failure::Kind::untrusted, "can't trust " + to_url(address_) + ": " + tell_distrust(reason));
      throw Failure(Failure::Kind::unreachable, "can't reach " + to_url(address_) +
                                                    ": it speaks no TLS that is known here (" + error.message() +
                                                    "); is it http:// there?");
    }
    check(error);
    if (const X509* shown = SSL_get0_peer_certificate(tls_->native_handle()))
      certificate_expires_ = proto::expiry_of(*shown);
  }

  /// Begins what is done with the connection as it is.
  template <typename Operation>
  void start(const Operation& operation) {
    tls_ ? operation(*tls_) : operation(stream_);
  }

  template <typename Serializer>
  void send(Serializer& serializer) {
    beast::error_code error;
    while (!serializer.is_done() && !error)
      write_some([&](auto& stream, auto done) { http::async_write_some(stream, serializer, done); }, error);
  }

  /// Waits for one write, and gives its bytes. When the server ends the connection there is an error and no throw: it
  /// may have refused already.
  template <typename Write>
  std::size_t write_some(const Write& write, beast::error_code& error) {
    std::size_t written = 0;
    stream_.expires_after(kIdleTimeout);
    start([&](auto& stream) {
      write(stream, [&](beast::error_code e, std::size_t bytes) { error = e, written = bytes; });
    });
    finish();
    if (error != asio::error::broken_pipe && error != asio::error::connection_reset) check(error);
    return written;
  }

  HttpResponse receive(const std::function<void(std::string_view)>& on_piece = nullptr) {
    http::response_parser<http::string_body> parser;
    parser.body_limit(std::numeric_limits<std::uint64_t>::max());
    received_.reserve(kPieceBytes);  // Beast reads as much as there is room for, else 512 bytes at a time.
    beast::error_code error;
    while (!parser.is_done()) {
      stream_.expires_after(kIdleTimeout);
      start([&](auto& stream) {
        http::async_read_some(stream, received_, parser, [&](beast::error_code e, std::size_t) { error = e; });
      });
      finish();
      check(error);
      std::string& body = parser.get().body();
      if (!on_piece || body.empty() || parser.get().result() != http::status::ok) continue;
      on_piece(body);
      body.clear();
    }
    auto message = parser.release();
    return {message.result_int(), std::string(message[http::field::retry_after]), std::move(message.body()),
            std::string(message[http::field::date]), certificate_expires_};
  }

  void finish() {
    io_.restart();
    io_.run();
  }

  void check(beast::error_code error) const {
    if (!error) return;
    const std::string why = error == beast::error::timeout ? "no answer in time" : error.message();
    throw Failure(Failure::Kind::unreachable, "can't reach " + to_url(address_) + ": " + why);
  }

  const ServerAddress& address_;
  asio::io_context io_{1};
  beast::tcp_stream stream_;
  std::optional<asio::ssl::context> tls_context_;
  std::optional<TlsStream> tls_;  ///< Over the stream, where the server speaks TLS.
  std::optional<std::chrono::sys_seconds> certificate_expires_;
  beast::flat_buffer received_;
};

/// "host:port".
std::string authority_of(const ServerAddress& address) {
  const bool is_ipv6 = address.host.find(':') != std::string::npos;
  return (is_ipv6 ? "[" + address.host + "]" : address.host) + ":" + address.port;
}

template <typename Body>
http::request<Body> head_of(const ServerAddress& address, const HttpRequest& request) {
  http::request<Body> head(http::string_to_verb(request.method), request.target, 11);
  head.set(http::field::host, authority_of(address));
  head.set(http::field::user_agent, "tessera");
  head.set(http::field::connection, "close");
  if (!request.key.empty()) head.set(http::field::authorization, "Bearer " + request.key);
  if (!request.content_type.empty()) head.set(http::field::content_type, request.content_type);
  return head;
}

OpenFile open_file(const std::filesystem::path& path) {
  OpenFile open;
  beast::error_code error;
  open.file.open(path.c_str(), beast::file_mode::scan, error);
  if (!error) open.size = open.file.size(error);
  if (error) throw Failure(Failure::Kind::local_file, "can't read " + path.string() + ": " + error.message());
  return open;
}

HttpResponse exchange_body(const ServerAddress& address, const HttpRequest& request, std::string text) {
  auto head = head_of<http::string_body>(address, request);
  head.body() = std::move(text);
  head.prepare_payload();
  return Connection(address).exchange(head);
}

HttpResponse exchange_body(const ServerAddress& address, const HttpRequest& request,
                           const std::filesystem::path& path) {
  OpenFile file = open_file(path);
  auto head = head_of<http::empty_body>(address, request);
  head.set(http::field::expect, "100-continue");
  head.content_length(file.size);
  return Connection(address).exchange(head, file);
}

}  // namespace

std::optional<ServerAddress> parse_server_url(std::string_view url) {
  const bool is_tls = url.starts_with(kTlsScheme);
  if (!is_tls && !url.starts_with(kPlainScheme)) return std::nullopt;
  url.remove_prefix(is_tls ? kTlsScheme.size() : kPlainScheme.size());
  if (url.ends_with('/')) url.remove_suffix(1);

  ServerAddress address{.host = {}, .port = is_tls ? "443" : "80", .is_tls = is_tls};
  if (url.starts_with('[')) {
    const auto end = url.find(']');
    if (end == url.npos) return std::nullopt;
    address.host = url.substr(1, end - 1);
    url.remove_prefix(end + 1);
  } else {
    const auto end = std::min(url.find(':'), url.size());
    address.host = url.substr(0, end);
    url.remove_prefix(end);
  }
  if (!url.empty()) {
    if (url.front() != ':') return std::nullopt;
    address.port = url.substr(1);
  }
  const bool is_number = std::ranges::all_of(address.port, [](char c) { return c >= '0' && c <= '9'; });
  const bool is_host = !address.host.empty() && address.host.find_first_of("/?#@ ") == std::string::npos;
  if (!is_host || !is_number || address.port.empty() || address.port.size() > 5) return std::nullopt;
  return address;
}

std::string to_url(const ServerAddress& address) {
  return std::string(address.is_tls ? kTlsScheme : kPlainScheme) + authority_of(address);
}

std::string percent_encode(std::string_view text) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string encoded;
  for (const char c : text) {
    const bool is_unreserved = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                               c == '.' || c == '_' || c == '~' || c == ':';
    const auto code = static_cast<unsigned char>(c);
    encoded += is_unreserved ? std::string{c} : std::string{'%', kHex[code >> 4], kHex[code & 15]};
  }
  return encoded;
}

HttpResponse exchange(const ServerAddress& address, HttpRequest request) {
  return std::visit([&](auto&& body) { return exchange_body(address, request, std::move(body)); },
                    std::move(request.body));
}

HttpResponse exchange(const ServerAddress& address, const HttpRequest& request,
                      const std::function<void(std::string_view)>& on_piece) {
  return Connection(address).exchange(head_of<http::empty_body>(address, request), on_piece);
}

}  // namespace tessera::client
