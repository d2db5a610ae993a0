#include "server/http/session.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include "server/config.h"
#include "server/http/authorization.h"
#include "server/http/chunked_body.h"
#include "server/http/cross_site.h"
#include "server/http/listener.h"
#include "server/http/request_head.h"
#include "server/http/request_id.h"
#include "server/http/response_head.h"
#include "server/http/router.h"
#include "server/http/transport.h"
#include "server/http/waiting.h"
#include "server/jobs/job_table.h"
#include "server/log.h"
#include "server/memory_reserve.h"
#include "server/metrics/metrics.h"
#include "server/store/blob_store.h"
#include "server/store/storage_error.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

constexpr std::size_t kFirstRead = 4 << 10;
constexpr std::size_t kPieceBytes = 64 << 10;
/// Of a file, to be written at once: what is done in a lane costs two changes of threads.
constexpr std::size_t kFilePieceBytes = 256 << 10;
constexpr std::chrono::seconds kLinger{2};
constexpr unsigned kMostSteps = 16;
/// Something is written at least so often to who reads a stream, so that it is noticed when nobody does any more.
constexpr std::chrono::seconds kHeartbeat{15};
/// Of what has been streamed and isn't sent yet; the system takes twice that.
constexpr int kStreamBuffer = 16 << 10;
/// Of encoded images that slow readers hold together.
constexpr std::uint64_t kMostAnswers = 4ULL << 30;
/// What the quick lane takes: documents of so many bytes, that name files of so many.
constexpr std::size_t kQuickDocument = 64 << 10;
constexpr std::uint64_t kQuickFiles = 256 << 10;

/// The status that is counted where nobody waited for any, as nginx does.
constexpr int kHungUp = 499;

constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
/// The answer that takes no memory.
constexpr std::string_view kNoMemory =
    "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/problem+json\r\nRetry-After: 1\r\n"
    "Connection: close\r\n\r\n"
    R"({"type":"/problems/out_of_memory_budget","title":"The server is short of memory","status":503,)"
    R"("detail":"Try again later.","code":"out_of_memory_budget","errors":[]})"
    "\n";

// Temporaries with destructors are kept out of co_await and co_return expressions throughout: g++ 12 may destroy
// those of braced initialisers twice.

Problem problem(ProblemCode code, std::string detail) { return {code, std::move(detail), {}}; }

// What makes JSON may draw on the reserve.
Response refuse(const Problem& why, Response (*as)(const Problem&) = problem_response) {
  const MemoryReserve::Share share;
  return as(why);
}
std::variant<const Route*, Response> route_of(const Config& config, Request& request) {
  const MemoryReserve::Share share;
  return find_route(config, request);
}
std::optional<Response> refuse_early(Services& services, const Route& route, Request& request) {
  const MemoryReserve::Share share;
  if (auto refused = refuse_stranger(services, route, request)) return refused;
  return refuse_request(route, request);
}

/// "127.0.0.1", "::1"; "-" where there is none.
std::string address_of_peer(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  char host[NI_MAXHOST];
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (::getpeername(socket, generic, &size) != 0 ||
      ::getnameinfo(generic, size, host, sizeof host, nullptr, 0, NI_NUMERICHOST) != 0)
    return "-";
  return host;
}

/// Counts one for as long as it lives.
template <typename Count>
class Counted {
 public:
  explicit Counted(std::atomic<Count>& count) : count_(count) { ++count_; }
  ~Counted() { --count_; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

 private:
  std::atomic<Count>& count_;
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

/// Bytes that have come in and weren't taken yet.
class Input {
 public:
  std::string_view bytes() const { return {buffer_.data() + begin_, end_ - begin_}; }
  void take(std::size_t count) { begin_ += count; }

  /// Room for up to `most` bytes together with those that are there.
  std::span<char> room(std::size_t most) {
    if (begin_ > 0) std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= std::exchange(begin_, 0);
    if (end_ == buffer_.size()) buffer_.resize(std::clamp(2 * end_, kFirstRead, std::max(most, end_ + 1)));
    return std::span(buffer_).subspan(end_);
  }
  void received(std::size_t count) { end_ += count; }

  /// Gives memory back that nothing stands in: a connection that waits keeps little.
  void shrink() {
    if (begin_ == end_ && buffer_.size() > kFirstRead) *this = {};
  }

 private:
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;
};

/// What is told of the request at hand when it has been answered.
struct AtHand {
  Channel::Clock::time_point since = Channel::Clock::now();  ///< When its header was there.
  std::size_t route = kNoRoute;
  std::string id, method, target;  ///< Method and target as sent.
  std::uint64_t bytes_sent = 0;    ///< Of its answer, header included.
};

/// Wakes a session that streams.
struct ToldOfMore final : EventFeed::Watcher {
  ToldOfMore(EventLoop& its_loop, Channel& channel) : loop(its_loop) { message.to = &channel; }
  void told() noexcept override { loop.post(message); }

  EventLoop& loop;
  EventLoop::Message message;
  bool is_watching = false;  ///< Until it has seen the message.
};

/// What became of work in a lane.
struct Outcome {
  std::optional<Response> response;  ///< None where there was no memory for any.
  bool was_too_heavy = false;
};

class Session {
 public:
  Session(EventLoop& loop, FileDescriptor socket, Connections& connections, std::coroutine_handle<> coroutine)
      : loop_(loop),
        channel_(loop, std::move(socket), coroutine),
        transport_(channel_.socket(), connections.tls),
        peer_(address_of_peer(channel_.socket())),
        connections_(connections),
        services_(connections.services),
        waiting_(loop, channel_, transport_, services_.jobs),
        timeout_(services_.config.timeout),
        local_address_(address_of(channel_.socket())) {}

  Task<bool> run() {
    bool goes_on = true;
    while (goes_on) goes_on = co_await exchange();
    co_return co_await close();
  }

 private:
  enum class Received { all, nothing, refused };

  /// One request and its response. Whether the connection goes on.
  Task<bool> exchange() {
    has_answered_ = false;
    at_hand_ = {};
    bool keep = false;
    try {
      keep = co_await answer_one();
    } catch (const std::bad_alloc&) {
      const RequestScope scope(at_hand_.id);
      spdlog::error("a request is refused: the server is out of memory");
      if (!has_answered_) transport_.send_at_once(kNoMemory);
      tell_end(503);
    }
    co_return keep;
  }

  Task<bool> answer_one() {
    MemoryReserve::refill();
    input_.shrink();
    RequestHead head;
    std::optional<Problem> wrong;
    const Received received = co_await receive_head(head, wrong);
    if (received == Received::nothing) co_return false;
    if (!wrong && transport_.lacks_tls())
      wrong = problem(ProblemCode::malformed_request, "This port speaks TLS: write https:// in place of http://.");
    const Counted active(connections_.requests_active);
    const bool stopping = services_.shutting_down;
    at_hand_.since = Channel::Clock::now();
    at_hand_.method = head.method;
    at_hand_.target = head.target;
    const auto given_id = head.headers.find("x-request-id");
    at_hand_.id = request_id(given_id == head.headers.end() ? std::nullopt : std::optional(given_id->second));
    body_is_read_ = !wrong && !head.has_body();
    Response response;
    if (wrong)
      response = refuse(*wrong);
    else
      response = co_await respond(head);
    if (channel_.broken().stop_requested()) {
      tell_end(kHungUp);
      co_return false;
    }
    add_request_id(response, at_hand_.id);
    // A body that wasn't read to its end stands where the next request should begin.
    const bool keep = head.keep_alive && body_is_read_ && !stopping && !response.stream;
    bool sent = co_await send(head, response, keep);
    if (sent && response.stream && head.method != "HEAD")
      sent = co_await stream(*response.stream, head.minor_version > 0);
    tell_end(response.status);
    co_return sent&& keep;
  }

  void tell_end(int status) {
    const RequestScope scope(at_hand_.id);
    const Channel::Clock::duration time = Channel::Clock::now() - at_hand_.since;
    metrics().request_answered(at_hand_.route, status, time);
    if (status == kHungUp)
      spdlog::debug("{} {} abandoned", at_hand_.method, at_hand_.target);
    else
      spdlog::debug("{} {} {}", at_hand_.method, at_hand_.target, status);
    if (!is_access_logged()) return;
    const LogField fields[] = {{"method", at_hand_.method},
                               {"path", at_hand_.target},
                               {"status", static_cast<std::uint64_t>(status)},
                               {"bytes", at_hand_.bytes_sent},
                               {"seconds", std::chrono::duration<double>(time).count()},
                               {"client", std::string_view(peer_)},
                               {"request_id", at_hand_.id}};
    log_access(fields);
  }

  Task<Received> receive_head(RequestHead& head, std::optional<Problem>& wrong) {
    RequestHeadParser parser;
    channel_.expires_after(timeout_);
    channel_.got_on();
    for (;;) {
      wrong = parser.advance(input_.bytes());
      if (wrong || parser.is_complete()) break;
      const bool more = co_await receive(RequestHeadParser::kMostBytes);
      if (more) continue;
      if (!parser.has_begun() || channel_.broken().stop_requested()) co_return Received::nothing;
      wrong = has_expired_ ? problem(ProblemCode::request_timeout, "The request's header took too long to arrive.")
                           : problem(ProblemCode::malformed_request, "The request breaks off before its header ends.");
      break;
    }
    input_.take(parser.size());
    head = parser.take_head();
    co_return wrong ? Received::refused : Received::all;
  }

  Task<Response> respond(const RequestHead& head) {
    Response response;
    Request request;
    request.id = at_hand_.id;
    request.abandoned = channel_.broken();
    if (auto wrong = read_request(head, request))
      response = refuse(*wrong);
    else
      response = co_await respond(head, request);
    tell_quota(services_, request, response);
    allow_origin(services_.config, request, response);
    co_return response;
  }

  Task<Response> respond(const RequestHead& head, Request& request) {
    Response response;
    if (auto wrong = refuse_host(services_.config, request, local_address_)) {
      response = refuse(*wrong);
      co_return response;
    }
    if (auto wrong = refuse_origin(services_.config, request)) {
      response = refuse(*wrong);
      co_return response;
    }
    const auto found = route_of(services_.config, request);
    at_hand_.route = request.route;
    if (const auto* answered = std::get_if<Response>(&found)) {
      response = *answered;
      co_return response;
    }
    const Route& route = *std::get<const Route*>(found);
    if (auto refused = refuse_early(services_, route, request)) {
      response = *std::move(refused);
      co_return response;
    }
    Share share(connections_.body_bytes);
    std::optional<Problem> wrong;
    try {
      wrong = co_await receive_body(head, route, request, share);
    } catch (const std::bad_alloc&) {
      wrong = problem(ProblemCode::out_of_memory_budget, "There is no memory for this body.");
    } catch (const StorageError& error) {  // The disk is full, say.
      const RequestScope scope(at_hand_.id);
      wrong = refuse(error);
    } catch (const std::exception& error) {
      const RequestScope scope(at_hand_.id);
      spdlog::error("receiving a body: {}", error.what());
      wrong = problem(ProblemCode::internal_error, "The server couldn't keep the body; its log says why.");
    }
    if (wrong)
      response = refuse(*wrong, route.refuse);
    else
      response = co_await handle(head, route, request);
    co_return response;
  }

  /// What a handler sees; a problem where the target is none.
  std::optional<Problem> read_request(const RequestHead& head, Request& request) {
    if (head.method != "OPTIONS" || head.target != "*") {
      auto target = parse_target(head.target);
      if (!target)
        return problem(ProblemCode::malformed_request, "The request target isn't a path with proper percent encoding.");
      request.target = *std::move(target);
    }
    request.is_head = head.method == "HEAD";
    request.method = request.is_head ? "GET" : head.method;
    request.headers = head.headers;
    return std::nullopt;
  }

  /// Runs the handler where it belongs, and what goes on for it when a job has ended.
  Task<Response> handle(const RequestHead& head, const Route& route, Request& request) {
    const bool may_ask = head.minor_version > 0;
    Response response = co_await answer(route, route.handle, request, may_ask);
    while (response.later) {
      const std::shared_ptr<const Later> later = std::move(response.later);
      co_await waiting_.for_job(*later, may_ask);
      response = Response();
      if (channel_.broken().stop_requested()) break;
      response = co_await answer(route, later->then, request, may_ask);
    }
    co_return response;
  }

  Task<Response> answer(const Route& route, const Handler& handler, Request& request, bool may_ask) {
    Outcome outcome;
    const auto run = [&] { outcome = run_guarded(route, handler, request); };
    const auto run_briefly = [&] {
      const FileBudget budget(kQuickFiles);
      run();
    };
    if (route.place == Place::io) {
      run();
    } else {
      const bool is_quick = route.place == Place::quick && request.body.size() <= kQuickDocument;
      if (is_quick) co_await waiting_.for_work(connections_.quick, run_briefly, may_ask);
      if (!is_quick || outcome.was_too_heavy) co_await waiting_.for_work(connections_.slow, run, may_ask);
    }
    if (!outcome.response && !channel_.broken().stop_requested()) throw std::bad_alloc();
    Response response = outcome.response.value_or(Response{});
    co_return response;
  }

  Outcome run_guarded(const Route& route, const Handler& handler, Request& request) noexcept {
    const MemoryReserve::Share share;
    const RequestScope scope(request.id);
    Outcome outcome;
    try {
      outcome.response = run_handler(route, handler, services_, request);
    } catch (const TooHeavy&) {
      outcome.was_too_heavy = true;
    } catch (...) {  // No memory for the refusal either.
    }
    return outcome;
  }

  /// Reads the body into the request, or says why not.
  Task<std::optional<Problem>> receive_body(const RequestHead& head, const Route& route, Request& request,
                                            Share& share) {
    std::optional<Problem> wrong;
    if (route.body == Body::none) {
      if (head.has_body()) wrong = problem(ProblemCode::malformed_request, "This request takes no body.");
      co_return wrong;
    }
    const std::uint64_t limit = route.body == Body::json ? services_.config.max_body : services_.config.max_blob;
    const Problem too_large =
        problem(ProblemCode::payload_too_large, "At most " + std::to_string(limit) + " bytes are taken here.");
    if (head.content_length > limit) {
      wrong = too_large;
      co_return wrong;
    }
    if (route.body != Body::json) request.file = services_.blobs.receive();
    if (head.has_body() && head.expects_continue && input_.bytes().empty()) {
      co_await write(kContinue, {});
      has_answered_ = false;  // That was no answer yet.
    }

    ChunkedBody chunked;
    std::uint64_t left = head.content_length, total = 0;
    std::string piece;  // Of a file: chunks may be small.
    const auto is_complete = [&] { return head.is_chunked ? chunked.is_complete() : left == 0; };
    while (!is_complete()) {
      std::string_view bytes = input_.bytes();
      std::string_view data = head.is_chunked ? chunked.next(bytes) : bytes.substr(0, std::min(left, bytes.size()));
      if (chunked.problem()) co_return chunked.problem();
      total += data.size();
      const bool takes_memory = route.body == Body::json || total <= ReceivedFile::kMostInMemory;
      if (total > limit) {
        wrong = too_large;
      } else if (takes_memory && !share.grow(data.size(), services_.config.max_bodies)) {
        wrong = problem(ProblemCode::out_of_memory_budget, "Too many documents are arriving at once.");
      } else if (route.body == Body::json) {
        request.body.append(data);
      } else {
        piece.append(data);
      }
      if (wrong) co_return wrong;
      if (head.is_chunked) {
        input_.take(input_.bytes().size() - bytes.size());
      } else {
        input_.take(data.size());
        left -= data.size();
      }
      if (piece.size() >= kFilePieceBytes || (!piece.empty() && is_complete())) {
        std::exception_ptr failure;
        const auto write_to_file = [&] {
          try {
            request.file->write(std::as_bytes(std::span(piece)));
          } catch (...) {
            failure = std::current_exception();
          }
        };
        if (request.file->has_memory_for(piece.size()))
          write_to_file();
        else
          co_await waiting_.for_work(connections_.quick, write_to_file, head.minor_version > 0);
        if (failure) std::rethrow_exception(failure);
        piece.clear();
      }
      if (!data.empty() || is_complete()) continue;
      channel_.expires_after(timeout_);
      const bool more = co_await receive(kPieceBytes);
      if (more) continue;
      wrong = has_expired_ ? problem(ProblemCode::request_timeout, "The body took too long to arrive.")
                           : problem(ProblemCode::malformed_request, "The body breaks off before its end.");
      co_return wrong;
    }
    body_is_read_ = true;
    co_return wrong;
  }

  /// Reads some bytes to those that are there, as long as these are fewer than `most`; false when none will come, or
  /// not in time, which `has_expired_` says then.
  Task<bool> receive(std::size_t most) {
    co_await give_way();
    const std::span<char> room = input_.room(most);
    for (;;) {
      const ssize_t count = transport_.receive(room);
      if (count > 0) {
        input_.received(static_cast<std::size_t>(count));
        moved(count);
        co_return true;
      }
      if (count < 0 && errno == EINTR) {
        co_await give_way();
        continue;
      }
      if (count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) co_return false;
      steps_ = 0;
      has_expired_ = !co_await channel_.change_by_peer();
      if (has_expired_) co_return false;
    }
  }

  /// Whether all of it went out.
  Task<bool> send(const RequestHead& head, const Response& response, bool keep) {
    const std::string text = response_head(response, keep, head.minor_version);
    const std::string_view body = is_bare(response) || head.method == "HEAD" ? std::string_view{} : response.content();
    Share share(connections_.answer_bytes);
    if (response.shared_body && !share.grow(body.size(), kMostAnswers)) throw std::bad_alloc();
    const bool sent = co_await write(text, body);
    co_return sent;
  }

  /// Writes what there is, as it comes, until there is no more, the client has gone, or the server stops.
  Task<bool> stream(Stream& from, bool is_chunked) {
    const Counted streams(connections_.streams);
    keep_little_unsent();
    ToldOfMore told(loop_, channel_);
    bool went_well = false;
    try {
      went_well = co_await stream(from, is_chunked, told);
    } catch (const std::exception& error) {
      const RequestScope scope(at_hand_.id);
      spdlog::error("a stream ends early: {}", error.what());
    }
    if (told.is_watching && !from.stop_watching(told))
      while (!told.message.is_done) co_await channel_.change();
    co_return went_well;
  }

  Task<bool> stream(Stream& from, bool is_chunked, ToldOfMore& told) {
    bool is_over = false, has_asked = false, went_well = true;
    while (!is_over && went_well) {
      if (!told.is_watching) told.is_watching = from.watch(told);  // Before it looks, so that nothing is missed.
      const auto now = Channel::Clock::now();
      Stream::Piece piece = next_piece(from, now);
      is_over = piece.is_last || services_.shutting_down;
      const bool has_to_ask = channel_.peer_has_finished() && !has_asked;
      if (has_to_ask) has_asked = true;
      const bool is_quiet = now - written_ >= kHeartbeat || has_to_ask;
      if (piece.text.empty() && is_quiet) piece.text = from.filler();
      if (!piece.text.empty()) {
        written_ = now;
        went_well = co_await write_piece(piece.text, is_chunked);
      }
      if (is_over || !went_well) break;
      const auto rested = now + from.rest(), until = std::max(rested, std::min(piece.next, written_ + kHeartbeat));
      const auto has_to_look = [&] {
        const auto at = Channel::Clock::now();
        return at >= until || (told.message.is_done && at >= rested) || channel_.broken().stop_requested() ||
               services_.shutting_down || (channel_.peer_has_finished() && !has_asked);
      };
      while (!has_to_look()) {
        channel_.expires_at(told.message.is_done ? rested : until);
        co_await channel_.change();
      }
      if (channel_.broken().stop_requested()) went_well = false;
      if (told.message.is_done) told.is_watching = told.message.is_done = false;
    }
    if (went_well && is_chunked) went_well = co_await write("0\r\n\r\n", {});
    co_return went_well;
  }

  static Stream::Piece next_piece(Stream& from, Channel::Clock::time_point now) {
    const MemoryReserve::Share share;
    return from.next(now);
  }

  /// As a chunk where these are known.
  Task<bool> write_piece(std::string& text, bool is_chunked) {
    char size[24] = "";
    if (is_chunked) {
      std::snprintf(size, sizeof size, "%zx\r\n", text.size());
      text += "\r\n";
    }
    const bool written = co_await write(size, text);
    co_return written;
  }

  /// What the system holds for a slow reader is old by the time that it is read; and who has gone without a word is to
  /// be noticed.
  void keep_little_unsent() {
    const int bytes = kStreamBuffer, milliseconds = static_cast<int>(std::chrono::milliseconds(timeout_).count());
    ::setsockopt(channel_.socket(), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    ::setsockopt(channel_.socket(), IPPROTO_TCP, TCP_USER_TIMEOUT, &milliseconds, sizeof milliseconds);
  }

  /// Piece by piece, so that a slow reader has the time that its link needs, and a stuck one hasn't.
  Task<bool> write(std::string_view first, std::string_view second) {
    channel_.expires_after(timeout_);
    channel_.got_on();
    while (!first.empty() || !second.empty()) {
      co_await give_way();
      const ssize_t count = transport_.send(first, second);
      if (count >= 0) {
        has_answered_ = true;
        at_hand_.bytes_sent += static_cast<std::uint64_t>(count);
        moved(count);
        const auto of_first = std::min(static_cast<std::size_t>(count), first.size());
        first.remove_prefix(of_first);
        second.remove_prefix(static_cast<std::size_t>(count) - of_first);
        channel_.expires_after(timeout_);
        continue;
      }
      if (errno == EINTR) continue;
      if (errno != EAGAIN && errno != EWOULDBLOCK) co_return false;
      steps_ = 0;
      const bool in_time = co_await channel_.change_by_peer();
      if (!in_time) co_return false;
    }
    co_return true;
  }

  /// Some bytes have come or gone. A peer gets on by pieces: whoever dawdles doesn't.
  void moved(ssize_t bytes) {
    moved_ += static_cast<std::size_t>(bytes);
    if (moved_ < kPieceBytes) return;
    moved_ = 0;
    channel_.got_on();
  }

  /// Lets the other connections of this loop have their turn, after some steps without having waited.
  Task<bool> give_way() {
    if (++steps_ > kMostSteps) {
      EventLoop::Message turn;
      turn.to = &channel_;
      loop_.post(turn);
      while (!turn.is_done) co_await channel_.change();
      steps_ = 0;
    }
    co_return true;
  }

  /// Says goodbye and reads on for a moment: closing on unread bytes would reset the connection and take the
  /// response away from a peer that is still sending.
  Task<bool> close() {
    if (channel_.broken().stop_requested()) co_return true;
    channel_.expires_after(kLinger);
    bool in_time = true;
    while (in_time && !transport_.finish()) in_time = co_await channel_.change();
    const auto end = Channel::Clock::now() + kLinger;
    for (bool more = true; more && Channel::Clock::now() < end;) {
      input_.take(input_.bytes().size());
      more = co_await receive(kPieceBytes);
    }
    co_return true;
  }

  EventLoop& loop_;
  Channel channel_;
  Transport transport_;
  const std::string peer_;  ///< Its address.
  Connections& connections_;
  Services& services_;
  Waiting waiting_;
  const std::chrono::seconds timeout_;
  const std::string local_address_;  ///< That the client has connected to, as "host:port".
  Input input_;
  bool has_expired_ = false;   ///< The last `receive` came too late.
  bool body_is_read_ = false;  ///< Of the request at hand.
  bool has_answered_ = false;  ///< Or begun to.
  AtHand at_hand_;
  Channel::Clock::time_point written_;  ///< When a stream was written to last.
  unsigned steps_ = 0;                  ///< Reads and writes since this waited last.
  std::size_t moved_ = 0;               ///< Bytes since the peer has got on.
};

}  // namespace

Detached serve(EventLoop& loop, FileDescriptor socket, Connections& connections) {
  const Counted open(connections.open);
  const std::coroutine_handle<> coroutine = co_await ThisCoroutine{};
  try {
    Session session(loop, std::move(socket), connections, coroutine);
    co_await session.run();
  } catch (const std::exception& error) {
    spdlog::error("a connection ended: {}", error.what());
  } catch (...) {
    spdlog::error("a connection ended");
  }
}

}  // namespace tessera::server
