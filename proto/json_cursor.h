#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/json_document.h"
#include "proto/wire/choice.h"

namespace tessera::proto {

/// A place in a document, and where to say what is wrong there. Cheap to copy; the document and the errors must
/// outlive it. The pointer of a place is worked out only when it is asked for.
class JsonCursor {
 public:
  JsonCursor(const JsonDocument& document, FieldErrors& errors, JsonDocument::Index index = JsonDocument::kRoot)
      : document_(&document), errors_(&errors), index_(index) {}

  const JsonDocument& document() const { return *document_; }
  FieldErrors& errors() const { return *errors_; }
  JsonDocument::Index index() const { return index_; }
  JsonKind kind() const { return document_->kind(index_); }
  bool is_number() const { return kind() == JsonKind::whole || kind() == JsonKind::real; }
  double number() const { return document_->number(index_); }
  std::string_view string() const { return document_->string(index_); }

  /// The number of elements or members. Precondition: an array or an object.
  std::uint32_t size() const { return document_->size(index_); }

  std::string pointer() const { return document_->pointer(index_); }

  /// Says what is wrong here; always false, so that a reader can end with it.
  bool error(std::string detail) const;

  /// "Expected a number, found the string "x"."
  bool expected(std::string_view what) const;

  /// A range over an array's elements. Precondition: an array.
  class Elements;
  Elements elements() const;

  /// The object's member of that name. Precondition: an object.
  std::optional<JsonCursor> member(std::string_view name) const;

  /// Calls `visit(key, value)` for an object's members in document order. Precondition: an object.
  template <typename Visit>
  void each_member(Visit visit) const {
    for (JsonDocument::Index i = index_ + 1; i < document_->next(index_); i = document_->next(i + 1)) {
      errors_->steps().take();
      visit(document_->string(i), at(i + 1));
    }
  }

 private:
  JsonCursor at(JsonDocument::Index index) const { return {*document_, *errors_, index}; }

  const JsonDocument* document_;
  FieldErrors* errors_;
  JsonDocument::Index index_;
};

class JsonCursor::Elements {
 public:
  explicit Elements(JsonCursor array) : array_(array) {}

  class Iterator {
   public:
    explicit Iterator(JsonCursor element) : element_(element) {}
    const JsonCursor& operator*() const { return element_; }
    Iterator& operator++() {
      element_.errors_->steps().take();
      element_.index_ = element_.document_->next(element_.index_);
      return *this;
    }
    bool operator!=(const Iterator& other) const { return element_.index_ != other.element_.index_; }

   private:
    JsonCursor element_;
  };
  Iterator begin() const { return Iterator(array_.at(array_.index_ + 1)); }
  Iterator end() const { return Iterator(array_.at(array_.document_->next(array_.index_))); }

 private:
  JsonCursor array_;
};

inline JsonCursor::Elements JsonCursor::elements() const { return Elements(*this); }

/// Reads an object's fields by name and remembers which names were asked for: the others are errors.
class JsonFields {
 public:
  /// `what` names the object in messages, say "a sphere"; it must outlive this. When `value` isn't an object, that
  /// is the one error: it has no fields then, and no required one is missed.
  JsonFields(JsonCursor value, std::string_view what);

  const JsonCursor& value() const { return value_; }

  /// Names the object more closely, once its type is known.
  void call(std::string_view what) { what_ = what; }
  std::optional<JsonCursor> optional(std::string_view name);
  std::optional<JsonCursor> required(std::string_view name);

  /// To be called once, after the last field was asked for.
  void refuse_unknown() const;

 private:
  JsonCursor value_;
  std::string_view what_;
  bool is_object_;
  std::vector<std::string_view> asked_;
};

/// Which numbers will do. The bounds hold for the number as a float, the precision that scenes are kept in.
struct NumberRange {
  float lo, hi;
  bool open;               ///< Whether the bounds themselves are out.
  std::string_view words;  ///< "a number that is at least 0"
};
extern const NumberRange kAnyNumber, kPositive, kNotNegative, kFraction;

// Readers. Each says what is wrong and leaves `out` alone when the value won't do; the return value tells. Absent
// values (nothing where an optional field would be) count as read well and leave `out` alone, too.
bool read(std::optional<JsonCursor> value, float& out, const NumberRange& range = kAnyNumber);
bool read(std::optional<JsonCursor> value, double& out);
bool read(std::optional<JsonCursor> value, bool& out);

/// An integer from `lo` to `hi`. 3.0 is one; 3.5 is none.
bool read(std::optional<JsonCursor> value, std::uint64_t& out, std::uint64_t lo, std::uint64_t hi);
bool read(std::optional<JsonCursor> value, std::uint32_t& out, std::uint32_t lo, std::uint32_t hi);

/// A string of at most `longest` characters (Unicode code points).
bool read(std::optional<JsonCursor> value, std::string& out, std::size_t longest);

/// The position in `names` of the string that stands there; `names.size()` and an error when it is none of them.
std::size_t read_choice(JsonCursor value, const std::vector<std::string_view>& names);

/// One of a few words.
template <typename T>
bool read(std::optional<JsonCursor> value, T& out, std::span<const Choice<T>> choices) {
  if (!value) return true;
  std::vector<std::string_view> names;
  for (const Choice<T>& choice : choices) names.push_back(choice.name);
  const std::size_t chosen = read_choice(*value, names);
  if (chosen == names.size()) return false;
  out = choices[chosen].value;
  return true;
}
template <typename T>
bool read(std::optional<JsonCursor> value, T& out, std::initializer_list<Choice<T>> choices) {
  return read(value, out, std::span<const Choice<T>>(choices.begin(), choices.size()));
}

}  // namespace tessera::proto
