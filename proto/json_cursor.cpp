#include "proto/json_cursor.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

namespace tessera::proto {
namespace {

constexpr float kLargest = std::numeric_limits<float>::max();
constexpr double kRoundsToInfinity = 0x1.ffffffp127;  // halfway from kLargest to 2^128

std::string as_text(double number) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  return {digits.data(), end};
}

std::string found(const JsonCursor& value) {
  switch (value.kind()) {
    case JsonKind::null:
      return "null";
    case JsonKind::boolean:
      return value.document().boolean(value.index()) ? "true" : "false";
    case JsonKind::whole:
      return std::to_string(value.document().whole(value.index()));
    case JsonKind::real:
      return as_text(value.number());
    case JsonKind::string:
      return "the string " + in_quotes(value.string());
    case JsonKind::array:
      return "an array of " + std::to_string(value.size());
    case JsonKind::object:
      return "an object";
  }
  return "";
}

std::string list(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) text += (text.empty() ? "" : ", ") + std::string(word);
  return text;
}

}  // namespace

const NumberRange kAnyNumber{-kLargest, kLargest, false, "a number from -3.4e38 to 3.4e38"};
const NumberRange kPositive{0, std::numeric_limits<float>::infinity(), true, "a number greater than 0, at most 3.4e38"};
const NumberRange kNotNegative{0, kLargest, false, "a number from 0 to 3.4e38"};
const NumberRange kFraction{0, 1, false, "a number from 0 to 1"};

bool JsonCursor::error(std::string detail) const {
  if (!errors_->full()) errors_->add(pointer(), std::move(detail));
  return false;
}

bool JsonCursor::expected(std::string_view what) const {
  if (errors_->full()) return false;
  return error("Expected " + std::string(what) + ", found " + found(*this) + ".");
}

std::optional<JsonCursor> JsonCursor::member(std::string_view name) const {
  for (JsonDocument::Index i = index_ + 1; i < document_->next(index_); i = document_->next(i + 1)) {
    errors_->steps().take();
    if (document_->string(i) == name) return at(i + 1);
  }
  return std::nullopt;
}

JsonFields::JsonFields(JsonCursor value, std::string_view what)
    : value_(value), what_(what), is_object_(value.kind() == JsonKind::object) {
  if (!is_object_) value_.expected(std::string(what_) + " (an object)");
}

std::optional<JsonCursor> JsonFields::optional(std::string_view name) {
  if (!is_object_) return std::nullopt;
  asked_.push_back(name);
  return value_.member(name);
}

std::optional<JsonCursor> JsonFields::required(std::string_view name) {
  auto field = optional(name);
  if (!field && is_object_) {
    value_.error("The field \"" + std::string(name) + "\" is missing; " + std::string(what_) + " needs it.");
  }
  return field;
}

void JsonFields::refuse_unknown() const {
  if (!is_object_) return;
  value_.each_member([&](std::string_view key, JsonCursor member) {
    if (std::ranges::find(asked_, key) == asked_.end() && !member.errors().full()) {
      member.error("Unknown field " + in_quotes(key) + ": " + std::string(what_) + " has only " + list(asked_) + ".");
    }
  });
}

bool read(std::optional<JsonCursor> value, float& out, const NumberRange& range) {
  if (!value) return true;
  if (!value->is_number() || !(std::abs(value->number()) < kRoundsToInfinity)) return value->expected(range.words);
  const auto number = static_cast<float>(value->number());
  const bool inside = range.open ? range.lo < number && number < range.hi : range.lo <= number && number <= range.hi;
  if (!inside) return value->expected(range.words);
  out = number;
  return true;
}

bool read(std::optional<JsonCursor> value, double& out) {
  float fits = 0;
  if (!value || !read(value, fits)) return !value;
  out = value->number();
  return true;
}

bool read(std::optional<JsonCursor> value, bool& out) {
  if (!value) return true;
  if (value->kind() != JsonKind::boolean) return value->expected("true or false");
  out = value->document().boolean(value->index());
  return true;
}

bool read(std::optional<JsonCursor> value, std::uint64_t& out, std::uint64_t lo, std::uint64_t hi) {
  if (!value) return true;
  constexpr double kTwoTo64 = 0x1p64;
  const double number = value->is_number() ? value->number() : -1;
  std::uint64_t whole = 0;
  bool is_whole = value->kind() == JsonKind::whole;
  if (is_whole) {
    whole = value->document().whole(value->index());
  } else if (number >= 0 && number < kTwoTo64 && number == std::floor(number)) {
    whole = static_cast<std::uint64_t>(number);
    is_whole = true;
  }
  if (!is_whole || whole < lo || whole > hi) {
    return value->expected("an integer from " + std::to_string(lo) + " to " + std::to_string(hi));
  }
  out = whole;
  return true;
}

bool read(std::optional<JsonCursor> value, std::uint32_t& out, std::uint32_t lo, std::uint32_t hi) {
  std::uint64_t wide = out;
  if (!read(value, wide, lo, hi)) return false;
  out = static_cast<std::uint32_t>(wide);
  return true;
}

bool read(std::optional<JsonCursor> value, std::string& out, std::size_t longest) {
  if (!value) return true;
  const auto characters = [](std::string_view text) {
    return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
  };
  if (value->kind() != JsonKind::string || characters(value->string()) > longest) {
    return value->expected("a string of at most " + std::to_string(longest) + " characters");
  }
  out = value->string();
  return true;
}

std::size_t read_choice(JsonCursor value, const std::vector<std::string_view>& names) {
  const auto chosen = value.kind() == JsonKind::string ? std::ranges::find(names, value.string()) : names.end();
  if (chosen == names.end()) value.expected("one of the strings " + list(names));
  return static_cast<std::size_t>(chosen - names.begin());
}

}  // namespace tessera::proto
