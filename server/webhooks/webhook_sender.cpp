#include "server/webhooks/webhook_sender.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string_view>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <openssl/ssl.h>

#include "proto/wire/certificate.h"
#include "server/webhooks/public_address.h"

namespace tessera::server {

struct WebhookSender::Trust {
  boost::asio::ssl::context context{boost::asio::ssl::context::tls_client};
};

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

constexpr std::uint32_t kMostAnswerHead = 8 << 10;
constexpr int kMostInterimAnswers = 8;
constexpr std::string_view kPrivate = " isn't an address of the internet (--webhook-allow-private)";
constexpr std::string_view kPublic = " is an address of the internet, where only https:// goes";

/// Why nothing came of it.
struct NotSent : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One connection. Asynchronous operations, waited for one by one: so that they end in time, or when they are to stop.
class WebhookConnection {
 public:
  WebhookConnection(const WebhookTarget& target, std::stop_token stop)
      : target_(target),
        stop_(std::move(stop)),
        interrupt_(stop_, [this] { asio::post(io_, [this] { stream_.close(); }); }) {}

  /// The addresses that the target has and that may be connected to.
  std::vector<tcp::endpoint> look_up(bool allow_private) {
    beast::error_code error;
    tcp::resolver resolver(io_);
    const auto found = resolver.resolve(target_.host, std::to_string(target_.port), error);
    if (error) throw NotSent("its name leads to no address: " + error.message());
    std::vector<tcp::endpoint> allowed;
    std::string refused;
    for (const auto& entry : found) {
      const std::string address = entry.endpoint().address().to_string();
      const bool is_public = is_public_address(address);
      if (is_public ? target_.is_tls : allow_private)
        allowed.push_back(entry.endpoint());
      else
        (refused = address) += is_public ? kPublic : kPrivate;
    }
    if (allowed.empty()) throw NotSent(refused);
    return allowed;
  }

  void connect(const std::vector<tcp::endpoint>& endpoints, std::chrono::milliseconds most) {
    stream_.expires_after(most);
    wait([&](auto done) {
      stream_.async_connect(endpoints, [done](beast::error_code error, const auto&) { done(error); });
    });
  }

  void shake_hands(asio::ssl::context& trust) {
    tls_.emplace(stream_, trust);
    if (!proto::expect_name(*tls_->native_handle(), target_.host))
      throw NotSent("'" + target_.host + "' is no name that a certificate could have");
    try {
      wait([&](auto done) { tls_->async_handshake(asio::ssl::stream_base::client, done); });
    } catch (const NotSent&) {
      const long reason = SSL_get_verify_result(tls_->native_handle());
      if (reason == X509_V_OK) throw;
      throw NotSent(std::string("its certificate isn't trusted: ") + X509_verify_cert_error_string(reason));
    }
  }

  WebhookAnswer exchange(const http::request<http::string_body>& request) {
    if (tls_) return exchange(*tls_, request);
    return exchange(stream_, request);
  }

 private:
  using TlsStream = beast::ssl_stream<beast::tcp_stream&>;
  using Done = std::function<void(beast::error_code)>;

  template <typename AsyncStream>
  WebhookAnswer exchange(AsyncStream& stream, const http::request<http::string_body>& request) {
    wait([&](const Done& done) {
      http::async_write(stream, request, [done](beast::error_code error, std::size_t) { done(error); });
    });
    beast::flat_buffer received(2 * kMostAnswerHead);
    for (int interim = 0; interim <= kMostInterimAnswers; ++interim) {
      http::response_parser<http::empty_body> parser;
      parser.header_limit(kMostAnswerHead);
      parser.body_limit(std::numeric_limits<std::uint64_t>::max());
      wait([&](const Done& done) {
        http::async_read_header(stream, received, parser,
                                [done](beast::error_code error, std::size_t) { done(error); });
      });
      const auto& head = parser.get();
      if (head.result_int() < 200) continue;
      return {head.result_int(), {}, retry_after(head[http::field::retry_after])};
    }
    throw NotSent("it goes on answering 1xx");
  }

  /// Its seconds; a date in its place is left out of account.
  static std::optional<std::chrono::seconds> retry_after(std::string_view text) {
    std::uint32_t seconds = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return std::chrono::seconds(seconds);
  }

  /// Begins an operation and waits for its end.
  void wait(const std::function<void(const Done&)>& begin) {
    if (stop_.stop_requested()) throw NotSent("the server stops");
    beast::error_code error;
    begin([&](beast::error_code outcome) { error = outcome; });
    io_.restart();
    io_.run();
    if (error) throw NotSent(error == beast::error::timeout ? "no answer in time" : error.message());
  }

  const WebhookTarget& target_;
  asio::io_context io_{1};
  beast::tcp_stream stream_{io_};
  std::optional<TlsStream> tls_;  ///< Over the stream, where the receiver speaks TLS.
  const std::stop_token stop_;
  const std::stop_callback<std::function<void()>> interrupt_;
};

}  // namespace

WebhookSender::WebhookSender(bool allow_private, std::chrono::milliseconds most)
    : trust_(std::make_unique<Trust>()), allow_private_(allow_private), most_(most) {
  SSL_CTX_set_min_proto_version(trust_->context.native_handle(), TLS1_2_VERSION);
  trust_->context.set_verify_mode(asio::ssl::verify_peer);
  trust_->context.set_default_verify_paths();
}

WebhookSender::~WebhookSender() = default;

WebhookAnswer WebhookSender::send(const WebhookTarget& target, const WebhookRequest& request,
                                  const std::stop_token& stop) const try {
  http::request<http::string_body> message(http::verb::post, target.path, 11);
  message.set(http::field::host, target.authority());
  message.set(http::field::user_agent, "tessera/" TESSERA_VERSION);
  message.set(http::field::content_type, "application/json");
  message.set(http::field::connection, "close");
  for (const auto& [name, value] : request.headers) message.set(name, value);
  message.body() = request.body;
  message.prepare_payload();

  WebhookConnection connection(target, stop);
  connection.connect(connection.look_up(allow_private_), most_);
  if (target.is_tls) connection.shake_hands(trust_->context);
  return connection.exchange(message);
} catch (const std::exception& error) {
  return {0, error.what()};
}

}  // namespace tessera::server
