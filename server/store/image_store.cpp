#include "server/store/image_store.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <fstream>
#include <istream>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "proto/wire/sha256.h"
#include "server/store/received_file.h"
#include "server/store/set_aside.h"
#include "server/store/storage_error.h"

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
constexpr const char* kExtension = ".film";
/// SQLite is as quick as files are with blobs of about that size (sqlite.org/intern-v-extern-blob.html).
constexpr std::size_t kMostInJournal = 128 << 10;

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

/// Writes an image to what has a function `write` for bytes.
template <typename Write>
void write_film(const Film& film, const Write& write_bytes) {
  const Pixels& pixels = film.pixels();
  FilmHeader header;
  header.width = static_cast<std::uint32_t>(pixels.rect.width());
  header.height = static_cast<std::uint32_t>(pixels.rect.height());
  for (const Aov aov : pixels.aovs()) header.aovs |= 1U << static_cast<unsigned>(aov);
  proto::Sha256 hash;
  const auto write = [&](std::span<const std::byte> bytes) {
    hash.update(bytes);
    write_bytes(bytes);
  };
  write(std::as_bytes(std::span(&header, 1)));
  for_planes(pixels, [&](const auto& plane) { write(plane_bytes(plane)); });
  const std::string digest = hash.finish();
  write_bytes(std::as_bytes(std::span(digest)));
}

/// Reads as long as there is what is asked for, and hashes that.
class FilmReader {
 public:
  explicit FilmReader(std::istream& from) : from_(from) {}

  void read(void* to, std::size_t size) {
    from_.read(static_cast<char*>(to), static_cast<std::streamsize>(size));
    if (from_.bad()) throw std::system_error(errno, std::generic_category(), "an image can't be read");
    if (static_cast<std::size_t>(from_.gcount()) != size) throw std::runtime_error("it is too short");
    hash_.update(std::span(static_cast<const std::byte*>(to), size));
  }

  void check_hash() {
    std::string written(kFilmHashSize, '\0');
    from_.read(written.data(), static_cast<std::streamsize>(written.size()));
    if (hash_.finish() != written) throw std::runtime_error("its bytes don't have their hash");
    if (from_.peek() != std::istream::traits_type::eof()) throw std::runtime_error("it is too long");
  }

 private:
  std::istream& from_;
  proto::Sha256 hash_;
};

/// An image of `size` bytes. Throws std::runtime_error for what isn't as `write_film` writes.
std::shared_ptr<const Film> read_film(std::istream& from, std::uint64_t size) {
  FilmReader reader(from);
  FilmHeader header, expected;
  reader.read(&header, sizeof header);
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
  for_planes(pixels, [&](auto& plane) { reader.read(plane.data(), plane.size() * sizeof(plane[0])); });
  reader.check_hash();
  auto film = std::make_shared<Film>(header.width, header.height, aovs, std::vector{rect});
  film->store(0, pixels);
  return film;
}

}  // namespace

std::shared_ptr<const std::string> ImageStore::for_journal(const Film& film) {
  const Pixels& pixels = film.pixels();
  if (pixels.color.size() * Pixels::bytes_per_pixel(pixels.aovs()) > kMostInJournal) return nullptr;
  auto bytes = std::make_shared<std::string>();
  write_film(film, [&](std::span<const std::byte> piece) {
    bytes->append(reinterpret_cast<const char*>(piece.data()), piece.size());
  });
  return bytes;
}

void ImageStore::keep(const std::string& job, const Film& film) const {
  ReceivedFile file(folder_);
  write_film(film, [&](std::span<const std::byte> piece) { file.write(piece); });
  file.keep_as(path_of(job));
}

std::set<std::string> ImageStore::jobs() const {
  std::set<std::string> jobs;
  for (std::string& job : journal_.images()) jobs.insert(std::move(job));
  for (const auto& entry : fs::directory_iterator(folder_))
    if (entry.path().extension() == kExtension) jobs.insert(entry.path().stem());
  return jobs;
}

std::optional<std::string> ImageStore::image_in_journal(const std::string& job) const try {
  return journal_.image(job);
} catch (const std::runtime_error& error) {
  throw StorageError(EIO, error.what());
}

std::shared_ptr<const Film> ImageStore::load(const std::string& job) const {
  const fs::path path = path_of(job);
  if (std::optional<std::string> bytes = image_in_journal(job)) {
    try {
      std::istringstream from(*bytes);
      return read_film(from, bytes->size());
    } catch (const std::runtime_error& error) {
      ReceivedFile file(folder_);
      file.write(std::as_bytes(std::span(*bytes)));
      file.keep_as(path);
      set_aside(path, set_aside_, error.what());
      return nullptr;
    }
  }
  std::error_code missing;
  const std::uint64_t size = fs::file_size(path, missing);
  if (missing) return nullptr;
  std::ifstream from(path, std::ios::binary);
  if (!from) throw std::system_error(errno, std::generic_category(), path.string());
  try {
    return read_film(from, size);
  } catch (const std::system_error&) {  // Which says nothing of what is in the file.
    throw;
  } catch (const std::runtime_error& error) {
    set_aside(path, set_aside_, error.what());
    return nullptr;
  }
}

void ImageStore::remove(const std::string& job) const { fs::remove(path_of(job)); }

std::vector<fs::path> ImageStore::set_strangers_aside(const std::set<std::string>& known) const {
  std::vector<fs::path> strangers;
  for (const auto& entry : fs::directory_iterator(folder_))
    if (!known.contains(entry.path().stem())) strangers.push_back(entry.path());
  for (const fs::path& file : strangers) set_aside(file, set_aside_, "its job isn't known any more");
  return strangers;
}

Shelf::Scrubbed ImageStore::scrub(const std::function<void(const fs::path& file)>& is_damaged) const {
  Shelf::Scrubbed scrubbed;
  for (const std::string& job : jobs()) {
    const auto film = load(job);
    ++scrubbed.files;
    if (film) {
      scrubbed.bytes += film->pixels().color.size() * Pixels::bytes_per_pixel(film->pixels().aovs());
    } else {
      ++scrubbed.damaged;
      is_damaged(path_of(job));
    }
  }
  return scrubbed;
}

}  // namespace tessera::server
