#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include "core/scene/texture.h"
#include "proto/import/input_file.h"

namespace tessera::proto {

/// The images beside a file, each opened once.
class TextureFiles {
 public:
  struct Opened {
    std::shared_ptr<const TextureImage> image;  ///< Null where it can't be used.
    std::string problem;                        ///< Why not.
    bool is_linear = false;                     ///< Its numbers are light as it is, whatever they are used for.
    bool has_alpha = false;
  };

  /// An image's texels may take `most_bytes`, and all files together.
  explicit TextureFiles(std::uint64_t most_bytes, std::stop_token stop = {})
      : most_bytes_(most_bytes), bytes_left_(most_bytes), stop_(std::move(stop)) {}

  /// `name` is how messages call it. What is returned stays where it is.
  const Opened& open(const InputFile& file, std::string_view name);

 private:
  std::uint64_t most_bytes_, bytes_left_;
  std::stop_token stop_;
  std::map<std::filesystem::path, Opened> opened_;
};

}  // namespace tessera::proto
