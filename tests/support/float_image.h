#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/math/rgb.h"

namespace tessera {

/// Linear radiance, row by row from the top.
struct FloatImage {
  std::uint32_t width = 0, height = 0;
  std::vector<Rgb> pixels;
};

constexpr std::array<double, 3> channels(Rgb c) { return {c.r, c.g, c.b}; }

/// Reads a colour PFM file (Debevec's portable float map: rows from the bottom). Throws std::runtime_error.
inline FloatImage read_pfm(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string kind;
  FloatImage image;
  double scale = 0;
  file >> kind >> image.width >> image.height >> scale;
  file.get();
  if (!file || kind != "PF" || !(scale < 0) || image.width == 0 || image.width > 65536 || image.height > 65536)
    throw std::runtime_error(path.string() + " isn't a colour PFM file of little-endian floats");
  static_assert(std::endian::native == std::endian::little && sizeof(Rgb) == 12, "rows are read as they lie");
  image.pixels.resize(std::size_t{image.width} * image.height);
  for (std::uint32_t y = image.height; y-- > 0;)
    file.read(reinterpret_cast<char*>(&image.pixels[std::size_t{y} * image.width]), 12L * image.width);
  if (!file) throw std::runtime_error(path.string() + " ends before its last row");
  return image;
}

/// Red, green and blue over all pixels.
inline std::array<double, 3> means(const FloatImage& image) {
  std::array<double, 3> sums{};
  for (const Rgb pixel : image.pixels)
    for (std::size_t c = 0; c < 3; ++c) sums[c] += channels(pixel)[c] / static_cast<double>(image.pixels.size());
  return sums;
}

/// relMSE: the mean over pixels and channels of (I − R)² / (R² + 0.01). Precondition: equal sizes.
inline double relative_mse(const FloatImage& image, const FloatImage& reference) {
  double sum = 0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const double truth = channels(reference.pixels[i])[c], off = channels(image.pixels[i])[c] - truth;
      sum += off * off / (truth * truth + 0.01);
    }
  return sum / (3 * static_cast<double>(image.pixels.size()));
}

}  // namespace tessera
