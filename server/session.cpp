#include "server/session.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <ctime>
#include <memory>
#include <optional>
#include <span>
#include <variant>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <spdlog/spdlog.h>

#include "server/blob_store.h"
#include "server/config.h"
#include "server/router.h"

namespace tessera::server {
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using proto::Problem;
using proto::ProblemCode;
using Parser = http::request_parser<http::buffer_body>;

namespace {

constexpr auto kAwait = asio::as_tuple(asio::use_awaitable);
constexpr std::uint32_t kHeaderLimit = 16 << 10;
constexpr std::size_t kPieceBytes = 128 << 10;
constexpr std::chrono::seconds kLinger{2};

// Temporaries with destructors are kept out of co_await and co_return expressions throughout: g++ 12 may destroy
// those of braced initialisers twice.

Problem problem(ProblemCode code, std::string detail) { return {code, std::move(detail), {}}; }

Response refusal(ProblemCode code, std::string detail) { return problem_response(problem(code, std::move(detail))); }

/// Runs `work` on the pool; the caller goes on, on its own executor, with the result.
template <typename Work>
asio::awaitable<std::invoke_result_t<Work>> run_on(asio::thread_pool& pool, Work work) {
  auto task = [&work]() -> asio::awaitable<std::invoke_result_t<Work>> { co_return work(); };
  co_return co_await asio::co_spawn(pool, task, asio::use_awaitable);
}

std::string http_date() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[64];
  return {text, std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &parts)};
}

/// Counts a request as active for as long as it lives.
class Active {
 public:
  explicit Active(std::atomic<int>& count) : count_(count) { ++count_; }
  ~Active() { --count_; }
  Active(const Active&) = delete;
  Active& operator=(const Active&) = delete;

 private:
  std::atomic<int>& count_;
};

/// A share of the memory for documents, given back at the end.
class Share {
 public:
  explicit Share(std::atomic<std::uint64_t>& total) : total_(total) {}
  ~Share() { total_ -= taken_; }
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;

  /// Whether all shares together still fit after this one grew.
  bool grow(std::uint64_t bytes, std::uint64_t limit) {
    taken_ += bytes;
    return (total_ += bytes) <= limit;
  }

 private:
  std::atomic<std::uint64_t>& total_;
  std::uint64_t taken_ = 0;
};

/// Reads what HTTP says of a request; a problem where it breaks the rules that Beast doesn't look at.
std::variant<Request, Problem> read_head(const Parser& parser) {
  const auto& message = parser.get();
  const auto malformed = [](const char* detail) { return problem(ProblemCode::malformed_request, detail); };
  if (message.version() == 11 && message.count(http::field::host) != 1)
    return malformed("An HTTP/1.1 request has one Host header.");
  if (message.has_content_length() && parser.chunked())
    return malformed("Send either Content-Length or Transfer-Encoding, not both.");
  if (message.count(http::field::transfer_encoding) > 0 &&
      !beast::iequals(message[http::field::transfer_encoding], "chunked"))
    return malformed("The only Transfer-Encoding known here is chunked.");
  auto target = parse_target({message.target().data(), message.target().size()});
  if (!target) return malformed("The request target isn't a path with proper percent encoding.");

  Request request;
  request.method = message.method() == http::verb::head ? "GET" : std::string(message.method_string());
  request.is_head = message.method() == http::verb::head;
  request.target = *std::move(target);
  for (const auto& field : message) {
    std::string name(field.name_string());
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    std::string& value = request.headers[name];
    value += (value.empty() ? "" : ", ") + std::string(field.value());
  }
  return request;
}

class Session {
 public:
  Session(asio::ip::tcp::socket socket, Connections& connections)
      : stream_(std::move(socket)),
        connections_(connections),
        services_(connections.services),
        timeout_(services_.config.timeout) {}

  asio::awaitable<void> run() {
    beast::error_code ignored;
    stream_.socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    while (co_await exchange()) {
    }
    co_await close();
  }

 private:
  /// One request and its response. Whether the connection goes on.
  asio::awaitable<bool> exchange() {
    Parser parser;
    parser.header_limit(kHeaderLimit);
    parser.body_limit(boost::none);  // Which limit holds is known once the route is.
    stream_.expires_after(timeout_);
    const auto [error, size] = co_await http::async_read_header(stream_, buffer_, parser, kAwait);
    const Active active(connections_.requests_active);
    if (error) co_return co_await answer_broken(parser, error);
    const bool stopping = services_.shutting_down;
    Response response = co_await respond(parser);
    spdlog::debug("{} {} {}", parser.get().method_string(), parser.get().target(), response.status);
    // A body that wasn't read to its end stands where the next request should begin.
    const bool keep = parser.get().keep_alive() && parser.is_done() && !stopping;
    co_return co_await send(parser, std::move(response), keep) && keep;
  }

  /// Says what was wrong with bytes that aren't HTTP; nothing to a peer that is gone, or too slow.
  asio::awaitable<bool> answer_broken(const Parser& parser, beast::error_code error) {
    const bool is_ours = error.category() == make_error_code(http::error::bad_method).category();
    if (is_ours && error != http::error::end_of_stream) {
      Response response =
          refusal(ProblemCode::malformed_request, "This isn't a complete request: " + error.message() + ".");
      co_await send(parser, std::move(response), false);
    }
    co_return false;
  }

  asio::awaitable<Response> respond(Parser& parser) {
    auto head = read_head(parser);
    if (const auto* wrong = std::get_if<Problem>(&head)) co_return problem_response(*wrong);
    Request request = std::get<Request>(std::move(head));
    const auto found = find_route(request);
    if (const auto* refused = std::get_if<Response>(&found)) co_return *refused;
    const Route& route = *std::get<const Route*>(found);
    Share share(connections_.body_bytes);
    std::optional<Problem> wrong;
    try {
      wrong = co_await receive_body(parser, route, request, share);
    } catch (const std::exception& error) {  // The disk is full, say.
      spdlog::error("receiving a body: {}", error.what());
      wrong = problem(ProblemCode::internal_error, "The server couldn't keep the body; its log says why.");
    }
    if (wrong) co_return problem_response(*wrong);
    auto handle = [&] { return run_handler(route, services_, request); };
    if (route.place == Place::io) co_return handle();
    co_return co_await run_on(connections_.workers, handle);
  }

  /// Reads the body into the request, or says why not.
  asio::awaitable<std::optional<Problem>> receive_body(Parser& parser, const Route& route, Request& request,
                                                       Share& share) {
    const auto announced = parser.content_length();
    const bool has_body = parser.chunked() || (announced && *announced > 0);
    if (route.body == Body::none) {
      std::optional<Problem> none;
      if (has_body) none = problem(ProblemCode::malformed_request, "This request takes no body.");
      co_return none;
    }
    const std::uint64_t limit = route.body == Body::json ? services_.config.max_body : services_.config.max_blob;
    const Problem too_large =
        problem(ProblemCode::payload_too_large, "At most " + std::to_string(limit) + " bytes are taken here.");
    if (announced && *announced > limit) co_return too_large;
    if (route.body == Body::file) request.file = services_.blobs.receive();
    if (beast::iequals(parser.get()[http::field::expect], "100-continue")) co_await send_continue();

    std::vector<char> piece(std::min<std::uint64_t>(kPieceBytes, announced.value_or(kPieceBytes)));
    buffer_.reserve(piece.size());  // Beast reads as much as there is room for, else 512 bytes at a time.
    std::span<const char> received;
    const auto write_to_file = [&] { request.file->write(std::as_bytes(received)); };
    for (std::uint64_t total = 0; !parser.is_done();) {
      auto& body = parser.get().body();
      body.data = piece.data();
      body.size = piece.size();
      stream_.expires_after(timeout_);
      const auto [error, size] = co_await http::async_read(stream_, buffer_, parser, kAwait);
      if (error && error != http::error::need_buffer) {
        const Problem broken = problem(ProblemCode::malformed_request, "The body broke off: " + error.message() + ".");
        co_return broken;
      }
      received = std::span(piece.data(), piece.size() - body.size);
      total += received.size();
      if (total > limit) co_return too_large;
      if (route.body == Body::file) {
        co_await run_on(connections_.workers, write_to_file);
      } else if (share.grow(received.size(), services_.config.max_bodies)) {
        request.body.append(received.data(), received.size());
      } else {
        const Problem full = problem(ProblemCode::out_of_memory_budget, "Too many documents are arriving at once.");
        co_return full;
      }
    }
    co_return std::nullopt;
  }

  asio::awaitable<void> send_continue() {
    http::response<http::empty_body> message(http::status::continue_, 11);
    co_await http::async_write(stream_, message, kAwait);
  }

  /// Whether all of it went out.
  asio::awaitable<bool> send(const Parser& parser, Response response, bool keep) {
    const auto& request = parser.get();
    const auto fill = [&](auto& message) {
      message.result(static_cast<unsigned>(response.status));
      message.version(request.version() == 10 ? 10 : 11);
      for (const auto& [name, value] : response.headers) message.insert(name, value);
      message.set(http::field::server, "tessera/" TESSERA_VERSION);
      message.set(http::field::date, http_date());
      message.keep_alive(keep);
    };
    const bool without_length = response.status == 204 || response.status == 304;
    if (without_length || request.method() == http::verb::head) {
      http::response<http::empty_body> message;
      fill(message);
      if (!without_length && response.has_length) message.content_length(response.content().size());
      co_return co_await write(message);
    }
    http::response<http::span_body<const char>> message;
    fill(message);
    message.body() = {response.content().data(), response.content().size()};
    message.prepare_payload();
    co_return co_await write(message);
  }

  /// Piece by piece, so that a slow reader has the time that its link needs, and a stuck one hasn't.
  template <typename Message>
  asio::awaitable<bool> write(Message& message) {
    http::response_serializer<typename Message::body_type> serializer(message);
    while (!serializer.is_done()) {
      stream_.expires_after(timeout_);
      const auto [error, size] = co_await http::async_write_some(stream_, serializer, kAwait);
      if (error) co_return false;
    }
    co_return true;
  }

  /// Says goodbye and reads on for a moment: closing on unread bytes would reset the connection and take the
  /// response away from a peer that is still sending.
  asio::awaitable<void> close() {
    beast::error_code error;
    stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, error);
    std::vector<char> rest(kPieceBytes);
    stream_.expires_after(kLinger);
    while (!error) std::tie(error, std::ignore) = co_await stream_.async_read_some(asio::buffer(rest), kAwait);
    stream_.close();
  }

  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  Connections& connections_;
  Services& services_;
  std::chrono::seconds timeout_;
};

}  // namespace

asio::awaitable<void> serve(asio::ip::tcp::socket socket, Connections& connections) {
  Session session(std::move(socket), connections);
  co_await session.run();
}

}  // namespace tessera::server
