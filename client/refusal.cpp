#include "client/refusal.h"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

namespace tessera::client {
namespace {

using nlohmann::json;

/// How the refusals are called here whose titles speak of requests.
struct Title {
  std::string_view code, title;
  bool has_detail;  ///< Whether what the server says of this case helps here.
};
constexpr Title kTitles[] = {
    {"malformed_json", "The server can't read the document", true},
    {"malformed_request", "The server can't do what was asked", true},
    {"unauthorized", "The server wants a valid key; give it by --key-file or TESSERA_KEY", true},
    {"forbidden", "The server doesn't allow this", true},
    {"not_found", "", true},
    {"method_not_allowed", "The server doesn't know this command; it may be of another version", false},
    {"not_acceptable", "The image doesn't come so", true},
    {"request_timeout", "Sending it took too long", false},
    {"target_too_long", "A name is too long for the server", false},
    {"payload_too_large", "Too large for this server", true},
    {"unsupported_media_type", "The server can't read what was sent; it may be of another version", false},
    {"request_in_progress", "The same was sent a moment ago, and isn't answered yet; try again", false},
    {"idempotency_key_reused", "Something else was sent under the same key before", false},
    {"hash_mismatch", "The file changed while it was sent; try again", false},
};

/// A clause that holds the first says the second here, or nothing.
constexpr std::pair<std::string_view, std::string_view> kClauses[] = {
    {"?partial", "--partial fetches the image so far"},
    {"/settings/aovs", "submit it with --aov"},
    {"name it by blob", ""},
    {"POST it again", "submit it again"},
    {"`tessera keys add`", ""},
    {"Authorization", ""},
    {"/v1/jobs", "'tessera list' lists all"},
    {"/v1/scenes", "submit the scene itself"},
    {"/v1/blobs", "name the file by its path"},
    {"query parameter", ""},
    {"`errors`", ""},
    {"Content-", ""},
    {"Accept", ""},
    {"HTTP", ""},
    {"GET ", ""},
    {"PUT ", ""},
    {"POST ", ""},
    {"DELETE ", ""},
};

std::string text_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Drops media types: "png (image/png), jpeg (image/jpeg)" names formats enough.
std::string without_media_types(std::string text) {
  for (std::size_t at = text.find(" (image/"); at != text.npos; at = text.find(" (image/", at))
    text.erase(at, std::min(text.find(')', at), text.size() - 1) + 1 - at);
  return text;
}

std::string in_our_words(const std::string& text) {
  std::string said, separator;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::size_t end = std::min({rest.find("; "), rest.find(". "), rest.size()});
    std::string_view clause = rest.substr(0, end);
    const std::string after(rest.substr(end, 2));
    rest.remove_prefix(end + after.size());
    for (const auto& [theirs, ours] : kClauses) {
      if (clause.find(theirs) == clause.npos) continue;
      clause = ours;
      break;
    }
    if (clause.empty()) continue;
    said += separator + std::string(clause);
    separator = after;
  }
  return without_media_types(std::move(said));
}

/// Options for the query's parameters, which have their names.
std::string place_of(const std::string& pointer) {
  if (!pointer.starts_with('?')) return pointer;
  std::string option = "--" + pointer.substr(1);
  std::ranges::replace(option, '_', '-');
  return option;
}

std::string message_of(const json& problem) {
  std::string title = text_of(problem, "title"), detail = in_our_words(text_of(problem, "detail"));
  const auto ours = std::ranges::find(kTitles, text_of(problem, "code"), &Title::code);
  if (ours != std::end(kTitles)) {
    title = ours->title;
    if (!ours->has_detail) detail.clear();
  }
  return title.empty() || detail.empty() ? title + detail : title + ": " + detail;
}

}  // namespace

std::vector<proto::FieldError> field_errors(const json& document, const char* key) {
  std::vector<proto::FieldError> errors;
  const json list = document.is_object() ? document.value(key, json()) : json();
  if (!list.is_array()) return errors;
  for (const json& error : list) {
    if (!error.is_object()) continue;
    const std::string pointer = text_of(error, "pointer"), detail = text_of(error, "detail");
    // What stands at a place of a document or a file may quote it.
    std::string ours = pointer.starts_with('/') || pointer.starts_with('?') ? in_our_words(detail) : detail;
    errors.push_back({place_of(pointer), ours.empty() ? detail : std::move(ours)});
  }
  return errors;
}

Failure refusal(const HttpResponse& response) {
  const json problem = json::parse(response.body, nullptr, false);
  std::string message, code;
  if (problem.is_object()) {
    message = message_of(problem);
    code = text_of(problem, "code");
  }
  if (message.empty())
    message = "The server refuses, with status " + std::to_string(response.status) + "; is this a Tessera server?";
  if (!response.retry_after.empty()) message += " (try again in " + response.retry_after + " s)";
  return {Failure::Kind::refused, message, field_errors(problem, "errors"), code};
}

}  // namespace tessera::client
