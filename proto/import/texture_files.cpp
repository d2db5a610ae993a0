#include "proto/import/texture_files.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <variant>
#include <vector>

#include "core/io/image_header.h"
#include "core/io/read_texture.h"
#include "proto/import/broken_file.h"
#include "proto/import/read_file.h"

namespace tessera::proto {
namespace {

TextureFiles::Opened opened(const std::string& content, std::uint64_t most_bytes) {
  const auto bytes = std::as_bytes(std::span(content));
  TextureFiles::Opened opened;
  const auto header = read_image_header(bytes);
  if (const auto* read = std::get_if<ImageHeader>(&header)) {
    const std::string_view kind = read->name;
    opened.is_linear = kind.ends_with(".hdr") || kind.ends_with(".exr");
    opened.has_alpha = read->has_alpha;
  }
  auto image = open_texture(std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end()), most_bytes);
  if (auto* texture = std::get_if<std::shared_ptr<const TextureImage>>(&image)) opened.image = std::move(*texture);
  if (auto* problem = std::get_if<std::string>(&image)) opened.problem = std::move(*problem);
  return opened;
}

}  // namespace

const TextureFiles::Opened& TextureFiles::open(const InputFile& file, std::string_view name) {
  const auto [known, is_new] = opened_.try_emplace(file.path);
  Opened& entry = known->second;
  if (!is_new) return entry;
  try {
    const std::string content = read_file(file, name, bytes_left_, stop_);
    bytes_left_ -= content.size();
    entry = opened(content, most_bytes_);
  } catch (const BrokenFile& broken) {
    entry.problem = broken.errors.front().detail;
  }
  while (entry.problem.ends_with('.')) entry.problem.pop_back();
  return entry;
}

}  // namespace tessera::proto
