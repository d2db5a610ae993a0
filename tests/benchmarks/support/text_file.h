#pragma once

#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string_view>

namespace tessera::bench {

/// A file that is written, much faster than by a stream's formatting. Numbers have as many digits as tell them apart.
class TextFile {
 public:
  explicit TextFile(const std::filesystem::path& path) : path_(path), file_(path, std::ios::binary) {}

  TextFile& operator<<(std::string_view text) {
    file_.write(text.data(), static_cast<std::streamsize>(text.size()));
    return *this;
  }
  template <typename Number>
  requires std::is_arithmetic_v<Number> TextFile& operator<<(Number number) {
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    return *this << std::string_view(digits.data(), static_cast<std::size_t>(end - digits.data()));
  }

  /// The value's bytes as they lie in memory.
  template <typename Value>
  void write_raw(const Value& value) {
    file_.write(reinterpret_cast<const char*>(&value), sizeof value);
  }

  /// Throws when anything couldn't be written.
  void close() {
    file_.close();
    if (!file_) throw std::runtime_error("can't write " + path_.string());
  }

 private:
  std::filesystem::path path_;
  std::ofstream file_;
};

}  // namespace tessera::bench
