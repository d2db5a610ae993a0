// What it costs to read files in processes of their own: the same files read
// there and in this process, in turns.
//
// tests/bench isolation: prints both medians and their difference for a small
// and a large model and image; the bar is for the small ones.
#include "server/isolation/isolation.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <png.h>

#include "core/io/read_texture.h"
#include "proto/asset_reader.h"
#include "server/isolation/isolated_reader.h"
#include "server/isolation/read_requests.h"
#include "tests/support/temporary_folder.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Between requests: there is a spare process again by then.
constexpr std::chrono::milliseconds kPause{30};
constexpr double kBar = 2;  ///< Milliseconds.

proto::Imported imported(const proto::AssetReader& reader, const fs::path& path) {
  const auto beside = [&](std::string_view name) -> std::optional<proto::InputFile> {
    return path.parent_path() / name;
  };
  auto read = reader.import(path, *proto::format_of(path.string()), "model", beside, {}, {}, 4ULL << 30);
  if (!read) throw std::runtime_error(read.problem().detail + ' ' + read.problem().errors.at(0).detail);
  return *std::move(read);
}

double milliseconds(const std::function<void()>& work) {
  const auto begun = Clock::now();
  work();
  return std::chrono::duration<double, std::milli>(Clock::now() - begun).count();
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

/// Prints one row; the difference in milliseconds.
double compare(const char* what, int times, const std::function<void(const proto::AssetReader&)>& work,
               const proto::AssetReader& isolated) {
  std::vector<double> here, there, more;
  for (int i = -1; i < times; ++i) {
    const double direct = milliseconds([&] { work(proto::direct_reader()); });
    std::this_thread::sleep_for(kPause);
    const double alone = milliseconds([&] { work(isolated); });
    if (i < 0) continue;  // Loads libraries.
    here.push_back(direct);
    there.push_back(alone);
    more.push_back(alone - direct);
  }
  std::printf("%-24s %10.3f ms here %10.3f ms alone %+9.3f ms\n", what, median(here), median(there), median(more));
  return median(more);
}

std::string obj_of(int vertices) {
  std::string text = "mtllib a.mtl\nusemtl a\n";
  std::array<char, 100> line{};
  for (int i = 0; i < vertices; ++i) {
    std::snprintf(line.data(), line.size(), "v %.6f %.6f %.6f\nvt %.4f 0.5\n", std::sin(i) * 3, std::cos(i * 0.7),
                  i * 1e-4, i * 1e-3);
    text += line.data();
    if (i < 2) continue;
    std::snprintf(line.data(), line.size(), "f %d/%d %d/%d %d/%d\n", i - 1, i - 1, i, i, i + 1, i + 1);
    text += line.data();
  }
  return text;
}

std::string stl_of(std::uint32_t triangles) {
  std::string file(80, ' ');
  file.append(reinterpret_cast<const char*>(&triangles), 4);
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const auto at = static_cast<float>(i);
    const std::array<float, 12> numbers{0, 0, 1, at, 0, 0, at + 1, 0, 0, at, 1, 0};
    file.append(reinterpret_cast<const char*>(numbers.data()), sizeof(numbers));
    file.append(2, '\0');
  }
  return file;
}

std::string png_of(std::uint32_t size) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = image.height = size;
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> pixels(std::size_t{size} * size * 3);
  std::uint32_t noise = 1;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    noise = noise * 1664525 + 1013904223;
    pixels[i] = static_cast<std::uint8_t>((i >> 6) + (noise >> 29));
  }
  png_alloc_size_t bytes = 0;
  png_image_write_get_memory_size(image, bytes, 0, pixels.data(), 0, nullptr);
  std::string file(bytes, '\0');
  if (!png_image_write_to_memory(&image, file.data(), &bytes, 0, pixels.data(), 0, nullptr))
    throw std::runtime_error("libpng fails");
  file.resize(bytes);
  return file;
}

void run() {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const server::Isolation isolation(server::read_in_worker, load_image_library);
  const server::IsolatedReader reader(isolation, 600);
  const TemporaryFolder small, large;
  small.write("a.mtl", "newmtl a\nmap_Kd a.png\n");
  small.write("a.png", png_of(64));
  large.write("a.mtl", "newmtl a\nmap_Kd a.png\n");
  large.write("a.png", png_of(4096));
  const auto import = [](const fs::path& path) {
    return [path](const proto::AssetReader& by) { (void)imported(by, path); };
  };
  const auto decode = [](const fs::path& path) {
    return [path](const proto::AssetReader& by) {
      const auto model = imported(by, path);
      if (model.textures.at(0).image->texels().width < 2) throw std::runtime_error("no image");
    };
  };
  const fs::path little = small.write("a.obj", obj_of(300));
  const fs::path much = large.write("a.obj", obj_of(400'000));
  const double small_model = compare("small OBJ", 60, import(little), reader);
  const double small_both = compare("small OBJ and PNG 64²", 60, decode(little), reader);
  compare("large OBJ", 3, import(much), reader);
  compare("large OBJ and PNG 4096²", 3, decode(much), reader);
  compare("STL of 100 MB", 3, import(large.write("a.stl", stl_of(2'000'000))), reader);
  const double small_image = small_both - small_model;
  std::printf("bar isolation.small_file %.3f ms, at most %.0f ms\n", std::max(small_model, small_image), kBar);
}

}  // namespace
}  // namespace tessera::bench

int main() try {
  tessera::bench::run();
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
