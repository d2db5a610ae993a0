#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "server/config.h"
#include "server/handlers/drake_form.h"
#include "server/handlers/image_choice.h"
#include "server/handlers/preference.h"
#include "server/http/byte_range.h"
#include "server/http/chunked_body.h"
#include "server/http/cross_site.h"
#include "server/http/http_syntax.h"
#include "server/http/media_type.h"
#include "server/http/multipart.h"
#include "server/http/request_head.h"
#include "server/http/request_id.h"
#include "server/http/response_head.h"
#include "server/http/router.h"
#include "server/jobs/event_feed.h"
#include "tests/support/fuzz_fail.h"

namespace tessera::server {

/// A request as it came in whole.
struct ReceivedRequest {
  RequestHead head;
  std::string body;
};

/// What a server makes of the bytes of one connection, in whatever pieces they come.
class Conversation {
 public:
  void receive(std::string_view bytes) {
    buffer_ += bytes;
    while (!refusal_ && (head_ ? read_body() : read_head())) {
    }
  }

  const std::vector<ReceivedRequest>& requests() const { return requests_; }
  const std::optional<proto::Problem>& refusal() const { return refusal_; }
  /// What has come of the body of a request that isn't whole.
  std::string_view begun_body() const { return body_; }
  /// Bytes that belong to no request yet.
  std::size_t left() const { return buffer_.size(); }

 private:
  /// Whether there is more to be read from what has come.
  bool read_head() {
    refusal_ = parser_.advance(buffer_);
    if (refusal_) return false;
    if (!parser_.is_complete()) {
      expect(buffer_.size() <= RequestHeadParser::kMostBytes, "a head without an end is neither taken nor refused");
      return false;
    }
    expect(parser_.size() <= buffer_.size() && parser_.size() <= RequestHeadParser::kMostBytes, "a head is too long");
    buffer_.erase(0, parser_.size());
    head_ = std::exchange(parser_, {}).take_head();
    left_ = head_->content_length;
    return true;
  }

  bool read_body() {
    const auto is_whole = [&] { return head_->is_chunked ? chunked_.is_complete() : left_ == 0; };
    std::string_view bytes = buffer_;
    while (!is_whole()) {
      const std::string_view data =
          head_->is_chunked ? chunked_.next(bytes) : bytes.substr(0, std::min<std::uint64_t>(left_, bytes.size()));
      refusal_ = chunked_.problem();
      if (refusal_) return false;
      body_ += data;
      if (!head_->is_chunked) {
        bytes.remove_prefix(data.size());
        left_ -= data.size();
      }
      if (data.empty() && !is_whole()) break;
    }
    buffer_.erase(0, buffer_.size() - bytes.size());
    if (!is_whole()) {
      expect(buffer_.empty(), "bytes of a body are left over");
      return false;
    }
    requests_.push_back({*std::exchange(head_, std::nullopt), std::exchange(body_, "")});
    chunked_ = {};
    return true;
  }

  std::string buffer_, body_;
  RequestHeadParser parser_;
  std::optional<RequestHead> head_;
  ChunkedBody chunked_;
  std::uint64_t left_ = 0;
  std::vector<ReceivedRequest> requests_;
  std::optional<proto::Problem> refusal_;
};

inline bool is_same(const RequestHead& a, const RequestHead& b) {
  return a.method == b.method && a.target == b.target && a.minor_version == b.minor_version && a.headers == b.headers &&
         a.keep_alive == b.keep_alive && a.expects_continue == b.expects_continue && a.is_chunked == b.is_chunked &&
         a.content_length == b.content_length;
}

/// What was said in pieces is what was said at once. Which of several faults is told may depend on what had come when
/// the first was seen; that there is one mayn't.
inline void check_same(const Conversation& a, const Conversation& b) {
  expect(a.refusal().has_value() == b.refusal().has_value(), "in pieces it is refused, or only then isn't");
  expect(a.requests().size() == b.requests().size(), "in pieces it is another number of requests");
  for (std::size_t i = 0; i < a.requests().size(); ++i) {
    expect(is_same(a.requests()[i].head, b.requests()[i].head), "in pieces a head is another");
    expect(a.requests()[i].body == b.requests()[i].body, "in pieces a body is another");
  }
  if (a.refusal()) return;
  expect(a.begun_body() == b.begun_body() && a.left() == b.left(), "in pieces something else is left");
}

/// Percent encoding of all that might mean something.
inline std::string encoded(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string out;
  for (const unsigned char c : text)
    if (std::isalnum(c))
      out += static_cast<char>(c);
    else
      (((out += '%') += kDigits[c / 16]) += kDigits[c % 16]);
  return out;
}

inline void check_head(const RequestHead& head) {
  expect(is_token(head.method) && !head.target.empty() && head.target.find(' ') == std::string::npos, "a request line");
  for (const auto& [name, value] : head.headers) {
    expect(is_token(name) && std::ranges::none_of(name, [](char c) { return c >= 'A' && c <= 'Z'; }),
           "a header's name");
    // The last of several may be empty.
    expect(is_field_value(value) && (trimmed(value) == value || value.ends_with(", ")), "a header's value");
  }
  const bool has_length = head.headers.contains("content-length");
  expect(!head.is_chunked || !has_length, "a body with two lengths");
  expect(head.is_chunked == head.headers.contains("transfer-encoding"), "a Transfer-Encoding that counts for nothing");
  expect(head.headers.contains("host") || head.minor_version == 0, "a request for nobody");
}

inline void check_target(const Target& target) {
  std::string text;
  for (const std::string& segment : target.segments) text += '/' + encoded(segment);
  for (const auto& [name, value] : target.query)
    text += (&value == &target.query.front().second ? '?' : '&') + encoded(name) + '=' + encoded(value);
  const auto again = parse_target(text);
  expect(again && again->segments == target.segments && again->query == target.query, "a target is another: " + text);
}

/// Nothing that came in gets out of its place in what goes out.
inline void check_response(const Response& response) {
  for (const bool keep : {false, true}) {
    std::string_view head = std::string_view();
    const std::string text = response_head(response, keep, 1);
    head = text;
    expect(head.starts_with("HTTP/1.1 ") && head.ends_with("\r\n\r\n"), "an answer's head");
    head.remove_suffix(2);
    for (bool is_first = true; !head.empty(); is_first = false) {
      const std::size_t end = head.find("\r\n");
      expect(end != head.npos && end > 0, "an answer's head ends early");
      const std::string_view line = head.substr(0, end);
      expect(is_first ? is_field_value(line) : is_field_line(line), "a line of an answer: " + std::string(line));
      head.remove_prefix(end + 2);
    }
  }
  for (const auto& [name, value] : response.headers)
    if (name == "Content-Type" && value.find("json") != value.npos)
      expect(nlohmann::json::accept(response.body), "an answer isn't JSON: " + response.body);
}

inline void check_range(const Request& request) {
  constexpr std::size_t kSize = 100;
  Response response{200, {{"ETag", "\"tag\""}}, std::string(kSize, 'x')};
  answer_range(request, response);
  check_response(response);
  if (response.status == 200 || response.status == 416) {
    expect(!response.part, "a part that nobody is told of");
    return;
  }
  expect(response.status == 206 && response.part, "a range's status");
  const auto [first, size] = *response.part;
  expect(size > 0 && first < kSize && size <= kSize - first, "a part beyond the whole");
}

/// Parts lie one behind the other in the body, and a form that is made of them has the same.
inline void check_form(std::string_view content_type, std::string_view body) {
  const auto parts = parse_form(content_type, body);
  if (!parts) return expect(!parts.problem().detail.empty(), "a form is refused without a word");
  expect(parts->size() <= kMostParts, "too many parts");
  std::string boundary = "b";
  while (body.find(boundary) != body.npos && boundary.size() < 60) boundary += "xy"[boundary.size() % 3 % 2];
  std::string form;
  const char* end = body.data();
  for (const FormPart& part : *parts) {
    expect(part.content.data() >= end && part.content.data() + part.content.size() <= body.data() + body.size(),
           "a part isn't in its place");
    end = part.content.data() + part.content.size();
    const auto quoted = [](std::string_view text) {
      std::string out = "\"";
      for (const char c : text) (c == '"' || c == '\\' ? out += '\\' : out) += c;
      return out + '"';
    };
    form += "--" + boundary + "\r\nContent-Disposition: form-data; name=" + quoted(part.name);
    if (part.file_name) form += "; filename=" + quoted(*part.file_name);
    form += "\r\n\r\n" + std::string(part.content) + "\r\n";
  }
  if (parts->empty()) return;
  form += "--" + boundary + "--";
  const auto again = parse_form("multipart/form-data; boundary=" + boundary, form);
  expect(again && again->size() == parts->size(), "a form isn't one any more: " + form);
  for (std::size_t i = 0; i < parts->size(); ++i) {
    const FormPart &a = (*parts)[i], &b = (*again)[i];
    expect(a.name == b.name && a.file_name == b.file_name && a.content == b.content, "a part is another: " + form);
  }
}

inline void check_chunks(const std::string& body) {
  std::string coded;
  for (std::size_t at = 0, size = 1; at < body.size(); at += size, size = size % 23 + 1) {
    const std::string_view piece = std::string_view(body).substr(at, size);
    char digits[8];
    const auto [end, error] = std::to_chars(std::begin(digits), std::end(digits), piece.size(), 16);
    coded.append(digits, end).append("\r\n").append(piece).append("\r\n");
  }
  coded += "0\r\n\r\n";
  ChunkedBody chunked;
  std::string_view rest = coded;
  std::string again;
  while (!chunked.is_complete() && !rest.empty() && !chunked.problem()) again += chunked.next(rest);
  expect(chunked.is_complete() && rest.empty() && again == body, "a body in chunks is another");
}

/// Takes a request as far as it goes without a server.
inline void check_request(const ReceivedRequest& received) {
  const RequestHead& head = received.head;
  check_head(head);
  expect(head.is_chunked || received.body.size() == head.content_length, "a body isn't as long as it says");
  check_chunks(received.body);

  Request request;
  request.is_head = head.method == "HEAD";
  request.method = request.is_head ? "GET" : head.method;
  request.headers = head.headers;
  const auto given = request.header("x-request-id");
  request.id = request_id(given);
  expect(!request.id.empty() && is_field_value(request.id), "a request's id");
  if (auto target = parse_target(head.target)) {
    request.target = *std::move(target);
    check_target(request.target);
  }

  static const Config config = [] {
    Config with;
    with.drake = true;
    with.host_names = {"render.example"};
    with.cors_origins = {"https://shop.example"};
    return with;
  }();
  const std::string host = canonical_host(request.host().value_or(""));
  expect(std::ranges::none_of(host, [](char c) { return c >= 'A' && c <= 'Z'; }), "a canonical host isn't one");
  Response response;
  if (auto wrong = refuse_host(config, request, "192.0.2.1:80"))
    response = problem_response(*wrong);
  else if (auto foreign = refuse_origin(config, request))
    response = problem_response(*foreign);
  else if (auto found = find_route(config, request); auto* answered = std::get_if<Response>(&found))
    response = *answered;
  else if (auto refused = refuse_request(*std::get<const Route*>(found), request))
    response = *refused;
  add_request_id(response, request.id);
  allow_origin(config, request, response);
  check_response(response);

  const Preference preference = read_preference(request);
  expect(!preference.wait || preference.wait->count() <= 24 * 3600, "a wait of more than a day");
  if (const std::string applied = preference.applied(); !applied.empty()) {
    Request asked;
    asked.headers["prefer"] = applied;
    expect(read_preference(asked).applied() == applied, "a preference isn't what is told of it");
  }
  const double weight = acceptance(request.header("accept").value_or(""), "image/png");
  expect(weight >= 0 && weight <= 1, "a weight of a media type");
  if (const auto id = read_event_id(request.header("last-event-id").value_or("")))
    expect(read_event_id(text_of(*id)) == id, "an event's id is another");
  check_range(request);
  check_form(request.header("content-type").value_or(""), received.body);
  if (const auto drake = read_drake_form(request, received.body); !drake)
    check_response(text_response(drake.problem()));
}

}  // namespace tessera::server
