#include "proto/json_document.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>
#include <optional>

#include <nlohmann/json.hpp>

namespace tessera::proto {
namespace {

constexpr std::string_view kMarkOfUtf8 = "\xEF\xBB\xBF";

Problem malformed(std::string_view bytes, std::size_t offset, const std::string& why) {
  offset = std::min(offset, bytes.size());
  const std::string_view before = bytes.substr(0, offset);
  const auto line = 1 + std::ranges::count(before, '\n');
  const std::size_t column = offset - (before.rfind('\n') + 1) + 1;  // npos + 1 is 0
  return {ProblemCode::malformed_json,
          "Not JSON at byte " + std::to_string(offset) + " (line " + std::to_string(line) + ", column " +
              std::to_string(column) + "): " + why,
          {}};
}

/// The library's message without its prefix and without the bytes that it quotes, which may not be UTF-8.
std::string reason(std::string_view what) {
  constexpr std::string_view kPrefix = "syntax error ", kQuote = "; last read: '";
  if (const auto prefix = what.find(kPrefix); prefix != std::string_view::npos) {
    what.remove_prefix(prefix + kPrefix.size());
  }
  return std::string(what.substr(0, what.find(kQuote))) + ".";
}

/// Walks over a text, and looks at times whether somebody still wants it.
class WatchedText {
 public:
  using iterator_category = std::forward_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  WatchedText(const char* at, Steps& steps) : at_(at), steps_(&steps) {}

  reference operator*() const { return *at_; }
  WatchedText& operator++() {
    ++at_;
    if (reinterpret_cast<std::uintptr_t>(at_) % kBytesBetweenLooks == 0) throw_if_abandoned(steps_->stop());
    return *this;
  }
  bool operator==(const WatchedText& other) const { return at_ == other.at_; }

 private:
  static constexpr std::uintptr_t kBytesBetweenLooks = 1 << 16;

  const char* at_;
  Steps* steps_;
};

/// More nodes than the text can hold: each but the root follows one of these characters.
std::size_t most_nodes(std::string_view bytes) {
  return 1 + static_cast<std::size_t>(
                 std::ranges::count_if(bytes, [](char c) { return c == ',' || c == ':' || c == '[' || c == '{'; }));
}

}  // namespace

/// Receives nlohmann-json's parser events.
class JsonDocumentBuilder {
 public:
  JsonDocumentBuilder(std::string_view bytes, std::uint32_t max_depth, FieldErrors& errors)
      : bytes_(bytes), max_depth_(max_depth), errors_(errors) {
    document_.nodes_.reserve(most_nodes(bytes));
  }

  bool null() { return add(JsonKind::null), true; }
  bool boolean(bool value) { return add(JsonKind::boolean).whole = value, true; }
  bool number_integer(std::int64_t value) { return add(JsonKind::real).real = static_cast<double>(value), true; }
  bool number_unsigned(std::uint64_t value) { return add(JsonKind::whole).whole = value, true; }
  bool number_float(double value, const std::string&) { return add(JsonKind::real).real = value, true; }
  bool string(const std::string& value) { return add(JsonKind::string).text = store(value), true; }
  bool binary(const nlohmann::json::binary_t&) { return false; }  // JSON text has none
  bool key(const std::string& value) {
    open_.back().key = next_index();
    return push(JsonKind::string).text = store(value), true;
  }
  bool start_object(std::size_t) { return open(JsonKind::object); }
  bool start_array(std::size_t) { return open(JsonKind::array); }
  bool end_array() { return close(), true; }
  bool end_object() {
    const Index object = open_.back().index;
    close();
    report_repeated_keys(object);
    return true;
  }

  bool parse_error(std::size_t position, const std::string& token, const nlohmann::json::exception& e) {
    // The library counts the byte that it stumbled over as read.
    const std::size_t offset = position > 0 ? position - 1 : 0;
    if (dynamic_cast<const nlohmann::json::out_of_range*>(&e) != nullptr) {
      errors_.add(pointer_of_next(), "The number " + in_quotes(token) + " overflows; write one of at most 3.4e38.");
      overflow_ = true;
    } else {
      problem_ = malformed(bytes_, offset, reason(e.what()));
    }
    return false;
  }

  Result<JsonDocument> finish() {
    if (problem_) return *std::move(problem_);
    if (overflow_) return std::move(errors_).as_problem("document");
    return std::move(document_);
  }

 private:
  using Index = JsonDocument::Index;
  struct Open {
    Index index;
    Index key = 0;           // of the member that is being read
    std::uint32_t size = 0;  // values read or being read
  };

  Index next_index() const { return static_cast<Index>(document_.nodes_.size()); }

  JsonDocument::Node& push(JsonKind kind) {
    const Index i = next_index();
    JsonDocument::Node& node = document_.nodes_.emplace_back();
    node.kind = kind;
    node.next = i + 1;
    return node;
  }

  JsonDocument::Node& add(JsonKind kind) {
    if (!open_.empty()) ++open_.back().size;
    return push(kind);
  }

  JsonDocument::Node::Text store(const std::string& value) {
    const auto offset = static_cast<std::uint32_t>(document_.text_.size());
    document_.text_ += value;
    return {offset, static_cast<std::uint32_t>(value.size())};
  }

  bool open(JsonKind kind) {
    if (open_.size() >= max_depth_) {
      problem_ = Problem{ProblemCode::malformed_json,
                         "The document nests deeper than " + std::to_string(max_depth_) + " levels.",
                         {{pointer_of_next(), "Nested too deep; no document of this service needs it."}}};
      return false;
    }
    const Index i = next_index();
    add(kind).next = std::numeric_limits<Index>::max();  // so that `pointer` finds its way through open containers
    open_.push_back({i});
    return true;
  }

  void close() {
    JsonDocument::Node& node = document_.nodes_[open_.back().index];
    node.size = open_.back().size;
    node.next = next_index();
    open_.pop_back();
  }

  /// Of the value that comes next, not counted yet.
  std::string pointer_of_next() const {
    std::string pointer;
    for (std::size_t i = 0; i < open_.size(); ++i) {
      const Open& level = open_[i];
      const bool counted = i + 1 < open_.size();
      pointer += document_.kind(level.index) == JsonKind::object ? pointer_part(document_.string(level.key))
                                                                 : "/" + std::to_string(level.size - (counted ? 1 : 0));
    }
    return pointer;
  }

  void report_repeated_keys(Index object) {
    keys_.clear();
    for (Index i = object + 1; i < document_.next(object); i = document_.next(i + 1)) {
      keys_.push_back(document_.string(i));
    }
    std::ranges::sort(keys_, [&](std::string_view a, std::string_view b) {
      errors_.steps().take();
      return a < b;
    });
    for (auto same = keys_.begin(); (same = std::adjacent_find(same, keys_.end())) != keys_.end();) {
      if (errors_.full()) return;
      const std::string_view key = *same;
      errors_.add(document_.pointer(object) + pointer_part(key),
                  "The key " + in_quotes(key) + " stands more than once in this object; keep one.");
      same = std::find_if(same, keys_.end(), [&](std::string_view other) { return other != key; });
    }
  }

  std::string_view bytes_;
  std::uint32_t max_depth_;
  FieldErrors& errors_;
  JsonDocument document_;
  std::vector<Open> open_;
  std::vector<std::string_view> keys_;  // scratch, kept for its capacity
  std::optional<Problem> problem_;
  bool overflow_ = false;
};

Result<JsonDocument> JsonDocument::parse(std::string_view bytes, std::uint32_t max_depth, FieldErrors& errors) {
  if (bytes.size() >= std::numeric_limits<Index>::max()) {
    return Problem{ProblemCode::payload_too_large, "The document is larger than 4 GiB; put big meshes into files.", {}};
  }
  // Two leniencies of the library: it skips a byte order mark, and takes a NUL for the end.
  if (bytes.starts_with(kMarkOfUtf8)) return malformed(bytes, 0, "a byte order mark. Save the text without it.");
  if (const auto nul = bytes.find('\0'); nul != std::string_view::npos) {
    return malformed(bytes, nul, "a NUL byte. JSON is UTF-8 text; write NUL in a string as \\u0000.");
  }
  JsonDocumentBuilder builder(bytes, max_depth, errors);
  nlohmann::json::sax_parse(WatchedText(bytes.data(), errors.steps()),
                            WatchedText(bytes.data() + bytes.size(), errors.steps()), &builder);
  return builder.finish();
}

std::string JsonDocument::pointer(Index target, Index base) const {
  std::string pointer;
  while (base != target) {
    const bool is_object = kind(base) == JsonKind::object;
    const Index step = is_object ? 1 : 0;  // over the key
    Index child = base + 1;
    std::uint64_t position = 0;
    while (next(child + step) <= target) {
      child = next(child + step);
      ++position;
    }
    pointer += is_object ? pointer_part(string(child)) : "/" + std::to_string(position);
    base = child + step;
  }
  return pointer;
}

}  // namespace tessera::proto
