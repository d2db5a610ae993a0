#include "core/io/exr_header.h"

#include <algorithm>
#include <string_view>

namespace tessera {
namespace {

constexpr std::uint32_t kDeep = 0x800, kSeveralParts = 0x1000;

/// A block of rows is as high as this at most, and takes two numbers of 8 bytes at least.
constexpr std::int64_t kMostRowsOfBlock = 256, kBytesOfBlock = 16;

constexpr std::uint32_t kLargestTile = 4096;
constexpr std::size_t kLongestChannelList = 4096;

/// What is left of a file.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes) : rest_(bytes) {}

  /// Nothing when they end before.
  std::optional<std::span<const std::byte>> take(std::size_t count) {
    if (count > rest_.size()) return std::nullopt;
    const auto taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  std::optional<std::string_view> take_text() {
    const auto end = std::ranges::find(rest_, std::byte{0});
    if (end == rest_.end()) return std::nullopt;
    const std::string_view text(reinterpret_cast<const char*>(rest_.data()),
                                static_cast<std::size_t>(end - rest_.begin()));
    rest_ = rest_.subspan(text.size() + 1);
    return text;
  }

 private:
  std::span<const std::byte> rest_;
};

std::uint32_t number(std::span<const std::byte> bytes, std::size_t index) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value |= std::to_integer<std::uint32_t>(bytes[4 * index + i]) << (8 * i);
  return value;
}

std::optional<std::string> window_problem(std::span<const std::byte> box, std::size_t file_size,
                                          std::uint64_t most_texels) {
  const auto side = [&](std::size_t from, std::size_t to) {
    return std::int64_t{static_cast<std::int32_t>(number(box, to))} - static_cast<std::int32_t>(number(box, from)) + 1;
  };
  const std::int64_t width = side(0, 2), height = side(1, 3);
  if (width < 1 || height < 1) return "It has no texels.";
  if (static_cast<std::uint64_t>(width) > most_texels / static_cast<std::uint64_t>(height))
    return "Its " + std::to_string(width) + " × " + std::to_string(height) +
           " texels take more memory than there may be.";
  if (height / kMostRowsOfBlock * kBytesOfBlock > static_cast<std::int64_t>(file_size))
    return "It ends before its last row.";
  return std::nullopt;
}

}  // namespace

std::optional<std::string> exr_header_problem(std::span<const std::byte> file, std::uint64_t most_texels) {
  const std::string broken = "Its header is broken.";
  Bytes bytes(file);
  const auto start = bytes.take(8);
  if (!start) return broken;
  if (number(*start, 1) & (kDeep | kSeveralParts)) return "It isn't a single flat picture.";
  for (bool has_window = false;;) {
    const auto name = bytes.take_text();
    if (!name) return broken;
    if (name->empty()) return has_window ? std::nullopt : std::optional(broken);
    const auto type = bytes.take_text();
    const auto length = bytes.take(4);
    const auto value = type && length ? bytes.take(number(*length, 0)) : std::nullopt;
    if (!value) return broken;
    if (*name == "dataWindow" || *name == "displayWindow") {
      if (value->size() != 16) return broken;
      if (auto problem = window_problem(*value, file.size(), most_texels)) return problem;
      has_window |= *name == "dataWindow";
    }
    if (*name == "channels" && value->size() > kLongestChannelList) return "It has too many channels.";
    if (*name == "tiles" && (value->size() != 9 || std::max(number(*value, 0), number(*value, 1)) > kLargestTile))
      return "Its tiles are too large.";
  }
}

}  // namespace tessera
