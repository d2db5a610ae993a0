#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace tessera::proto {

/// The last value of an enumeration whose values are 0 and up; a specialisation for each that is flattened.
template <typename Enum>
inline constexpr Enum kLastOf = [] { static_assert(sizeof(Enum) == 0, "say which is its last value"); }();

/// Bytes that aren't what `FlatWriter` writes.
class NotFlat : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Writes values as bytes for another process of this program. How a type is written, `flatten(archive, value)` says,
/// which takes it apart for writer and reader alike.
class FlatWriter {
 public:
  template <typename T>
  using Of = const T;

  template <typename... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }

  /// Numbers: long ones aren't copied, and have to stay where they are.
  template <typename T>
  void array(std::span<const T> values) {
    const auto bytes = std::as_bytes(values);
    const bool is_long = bytes.size() >= kLong;
    (*this)(std::uint64_t{bytes.size()}, is_long);
    if (!is_long) return append(bytes);
    (*this)(arrays_bytes_);
    arrays_.push_back(bytes);
    arrays_bytes_ += (bytes.size() + kAlignment - 1) / kAlignment * kAlignment;
  }
  template <typename T>
  void array(const std::vector<T>& values) {
    array(std::span<const T>(values));
  }

  /// Calls `write` with spans of bytes, whose sequence is what was written.
  template <typename Write>
  void finish(Write write) const {
    static constexpr std::array<std::byte, kAlignment> kNothing{};
    const std::uint64_t size = records_.size();
    const auto pad = [&](std::size_t bytes) {
      if (bytes % kAlignment != 0) write(std::span(kNothing).first(kAlignment - bytes % kAlignment));
    };
    write(std::as_bytes(std::span(&size, 1)));
    write(std::as_bytes(std::span(records_)));
    pad(sizeof(size) + records_.size());
    for (const auto& bytes : arrays_) {
      write(bytes);
      pad(bytes.size());
    }
  }

  static constexpr std::size_t kAlignment = 16;

 private:
  static constexpr std::size_t kLong = 4096;

  void append(std::span<const std::byte> bytes) {
    records_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }

  template <typename T>
  void put(const T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      records_ += value ? '\1' : '\0';
    } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      append(std::as_bytes(std::span(&value, 1)));
    } else {
      flatten(*this, value);
    }
  }
  void put(const std::string& text) {
    put(std::uint64_t{text.size()});
    records_ += text;
  }
  template <typename T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <typename T>
  void put(const std::vector<T>& values) {
    put(std::uint64_t{values.size()});
    for (const T& value : values) put(value);
  }
  template <typename T, std::size_t N>
  void put(const std::array<T, N>& values) {
    for (const T& value : values) put(value);
  }
  template <typename... T>
  void put(const std::variant<T...>& value) {
    put(static_cast<std::uint8_t>(value.index()));
    std::visit([&](const auto& held) { put(held); }, value);
  }

  std::string records_;
  std::vector<std::span<const std::byte>> arrays_;
  std::uint64_t arrays_bytes_ = 0;
};

/// Reads what a `FlatWriter` wrote, or throws `NotFlat`: the bytes may be anything. Numbers are finite, lists no longer
/// than there are bytes for, enumerations and variants in their ranges.
class FlatReader {
 public:
  template <typename T>
  using Of = T;

  /// `bytes` have to stay where they are.
  explicit FlatReader(std::span<const std::byte> bytes) {
    std::uint64_t size = 0;
    if (bytes.size() < sizeof(size)) fail();
    std::memcpy(&size, bytes.data(), sizeof(size));
    bytes = bytes.subspan(sizeof(size));
    if (size > bytes.size()) fail();
    records_ = bytes.first(static_cast<std::size_t>(size));
    const std::size_t before = sizeof(size) + records_.size();
    const std::size_t padding =
        (FlatWriter::kAlignment - before % FlatWriter::kAlignment) % FlatWriter::kAlignment + records_.size();
    arrays_ = bytes.subspan(std::min(padding, bytes.size()));
  }

  [[noreturn]] static void fail() { throw NotFlat("The bytes aren't what they should be."); }
  static void expect(bool good) {
    if (!good) fail();
  }

  template <typename... T>
  void operator()(T&... values) {
    (get(values), ...);
  }

  /// The bytes of an array, which may be aligned for nothing.
  std::span<const std::byte> array_bytes() {
    std::uint64_t size = 0;
    bool is_long = false;
    (*this)(size, is_long);
    if (!is_long) return take(size);
    std::uint64_t offset = 0;
    (*this)(offset);
    expect(offset <= arrays_.size() && size <= arrays_.size() - offset);
    return arrays_.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(size));
  }

  template <typename T>
  void array(std::vector<T>& values) {
    const auto bytes = array_bytes();
    expect(bytes.size() % sizeof(T) == 0);
    if (bytes.empty()) return;
    if (reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(T) == 0) {
      const T* first = reinterpret_cast<const T*>(bytes.data());
      values.assign(first, first + bytes.size() / sizeof(T));  // Without filling them with zeros first.
    } else {
      values.resize(bytes.size() / sizeof(T));
      std::memcpy(values.data(), bytes.data(), bytes.size());
    }
  }

  /// For numbers that may be infinite.
  void any_number(float& value) {
    std::memcpy(&value, take(sizeof(value)).data(), sizeof(value));
    expect(!std::isnan(value));
  }

  void expect_end() const { expect(records_.empty()); }

 private:
  std::span<const std::byte> take(std::uint64_t size) {
    expect(size <= records_.size());
    const auto taken = records_.first(static_cast<std::size_t>(size));
    records_ = records_.subspan(static_cast<std::size_t>(size));
    return taken;
  }

  template <typename T>
  void get(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      value = take(1).front() != std::byte{0};
    } else if constexpr (std::is_enum_v<T>) {
      std::underlying_type_t<T> number{};
      get(number);
      expect(number >= 0 && number <= static_cast<std::underlying_type_t<T>>(kLastOf<T>));
      value = static_cast<T>(number);
    } else if constexpr (std::is_arithmetic_v<T>) {
      std::memcpy(&value, take(sizeof(value)).data(), sizeof(value));
      if constexpr (std::is_floating_point_v<T>) expect(std::isfinite(value));
    } else {
      flatten(*this, value);
    }
  }
  void get(std::string& text) {
    std::uint64_t size = 0;
    get(size);
    const auto bytes = take(size);
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  template <typename T>
  void get(std::optional<T>& value) {
    bool is_there = false;
    get(is_there);
    if (is_there) get(value.emplace(T{}));
  }
  template <typename T>
  void get(std::vector<T>& values) {
    std::uint64_t size = 0;
    get(size);
    expect(size <= records_.size());
    for (; size > 0; --size) get(values.emplace_back(T{}));
  }
  template <typename T, std::size_t N>
  void get(std::array<T, N>& values) {
    for (T& value : values) get(value);
  }
  template <typename... T>
  void get(std::variant<T...>& value) {
    std::uint8_t index = 0;
    get(index);
    expect(index < sizeof...(T));
    std::uint8_t at = 0;
    ((at++ == index ? get(value.template emplace<T>(T{})) : void()), ...);
  }

  std::span<const std::byte> records_, arrays_;
};

}  // namespace tessera::proto
