#include "server/store/image_store.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <fstream>
#include <limits>
#include <set>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/spdlog.h>

#include "proto/wire/sha256.h"
#include "server/store/received_file.h"

namespace tessera::server {
namespace fs = std::filesystem;

namespace {

static_assert(std::endian::native == std::endian::little, "files are written as memory is");

/// What a file begins with. The planes follow, colour first and the AOVs in their order, and the hash of all that, as
/// text.
struct FilmHeader {
  std::array<char, 8> magic = {'t', 'e', 's', 's', 'f', 'i', 'l', 'm'};
  std::uint32_t version = 1;  ///< To be raised with each change of Aov's enumerators, too.
  std::uint32_t width = 0, height = 0;
  std::uint32_t aovs = 0;  ///< By bits: 1 << Aov.

  bool operator==(const FilmHeader&) const = default;
};
static_assert(kAovCount <= std::numeric_limits<std::uint32_t>::digits);
static_assert(std::has_unique_object_representations_v<FilmHeader>);

constexpr std::size_t kFilmHashSize = 71;  // "sha256:" and 64 digits.

template <typename T>
std::span<const std::byte> plane_bytes(const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  return std::as_bytes(std::span(values));
}

/// Calls `use` with all values of an image, plane by plane.
template <typename PixelsOrConst, typename Use>
void for_planes(PixelsOrConst& pixels, const Use& use) {
  use(pixels.color);
  for (const Aov aov : pixels.aovs())
    std::visit([&]<typename T>(const std::vector<T>&) { use(pixels.template plane<T>(aov)); }, pixels.values(aov));
}

/// Reads a file as long as it has what is asked for, and hashes that.
class FilmReader {
 public:
  explicit FilmReader(const fs::path& path) : file_(path, std::ios::binary) {
    if (!file_) throw std::system_error(errno, std::generic_category(), path.string());
  }

  void read(void* to, std::size_t size) {
    file_.read(static_cast<char*>(to), static_cast<std::streamsize>(size));
    if (file_.bad()) throw std::system_error(errno, std::generic_category(), "an image can't be read");
    if (static_cast<std::size_t>(file_.gcount()) != size) throw std::runtime_error("it is too short");
    hash_.update(std::span(static_cast<const std::byte*>(to), size));
  }

  void check_hash() {
    std::string written(kFilmHashSize, '\0');
    file_.read(written.data(), static_cast<std::streamsize>(written.size()));
    if (hash_.finish() != written) throw std::runtime_error("its bytes don't have their hash");
    if (file_.peek() != std::ifstream::traits_type::eof()) throw std::runtime_error("it is too long");
  }

 private:
  std::ifstream file_;
  proto::Sha256 hash_;
};

}  // namespace

void ImageStore::keep(const std::string& job, const Film& film) const {
  const Pixels& pixels = film.pixels();
  FilmHeader header;
  header.width = static_cast<std::uint32_t>(pixels.rect.width());
  header.height = static_cast<std::uint32_t>(pixels.rect.height());
  for (const Aov aov : pixels.aovs()) header.aovs |= 1U << static_cast<unsigned>(aov);
  ReceivedFile file(folder_);
  proto::Sha256 hash;
  const auto write = [&](std::span<const std::byte> bytes) {
    hash.update(bytes);
    file.write(bytes);
  };
  write(std::as_bytes(std::span(&header, 1)));
  for_planes(pixels, [&](const auto& plane) { write(plane_bytes(plane)); });
  const std::string digest = hash.finish();
  file.write(std::as_bytes(std::span(digest)));
  file.keep_as(path_of(job));
}

bool ImageStore::has(const std::string& job) const { return fs::exists(path_of(job)); }

std::shared_ptr<const Film> ImageStore::load(const std::string& job) const try {
  const fs::path path = path_of(job);
  std::error_code error;
  const std::uint64_t size = fs::file_size(path, error);
  if (error) return nullptr;
  FilmReader file(path);
  FilmHeader header, expected;
  file.read(&header, sizeof header);
  expected.width = header.width;
  expected.height = header.height;
  expected.aovs = header.aovs;
  std::set<Aov> aovs;
  for (unsigned i = 0; i < kAovCount; ++i)
    if (header.aovs & (1U << i)) aovs.insert(static_cast<Aov>(i));
  if (header != expected || header.aovs >> kAovCount != 0)
    throw std::runtime_error("it isn't an image that this program knows");
  // Before there is memory for it.
  const std::uint64_t rest = size - std::min<std::uint64_t>(size, sizeof header + kFilmHashSize);
  const std::uint64_t pixel_bytes = Pixels::bytes_per_pixel(aovs);
  if (rest % pixel_bytes != 0 || rest / pixel_bytes != std::uint64_t{header.width} * header.height)
    throw std::runtime_error("it has another size than it says");
  const PixelRect rect{0, 0, static_cast<std::int32_t>(header.width), static_cast<std::int32_t>(header.height)};
  Pixels pixels(rect, aovs);
  for_planes(pixels, [&](auto& plane) { file.read(plane.data(), plane.size() * sizeof(plane[0])); });
  file.check_hash();
  auto film = std::make_shared<Film>(header.width, header.height, aovs, std::vector{rect});
  film->store(0, pixels);
  return film;
} catch (const std::system_error&) {  // Which says nothing of what is in the file.
  throw;
} catch (const std::runtime_error& error) {
  put_aside(job, error.what());
  return nullptr;
}

void ImageStore::put_aside(const std::string& job, const std::string& why) const {
  const fs::path path = path_of(job);
  spdlog::error("the image {} is damaged: {}; it is put into {}", path.string(), why, set_aside_.string());
  std::error_code error;
  fs::create_directories(set_aside_, error);
  fs::rename(path, set_aside_ / path.filename(), error);
  if (error) fs::remove(path, error);
}

void ImageStore::remove(const std::string& job) const { fs::remove(path_of(job)); }

}  // namespace tessera::server
