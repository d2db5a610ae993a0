#include "server/store/image_store.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/image.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

/// An image of 5×3 pixels with a plane of each type, all values different.
std::unique_ptr<const Film> film_with_planes() {
  const std::set<Aov> aovs{Aov::depth, Aov::normal, Aov::object_id, Aov::albedo};
  const PixelRect rect{0, 0, 5, 3};
  Pixels pixels(rect, aovs);
  for (std::size_t i = 0; i < pixels.color.size(); ++i) {
    const auto value = static_cast<float>(i);
    pixels.color[i] = {value, value + 0.25F, -value};
    pixels.record(Aov::depth, i, 1 / (value + 1));
    pixels.record(Aov::normal, i, Vec3{value, 1, 2});
    pixels.record(Aov::object_id, i, static_cast<std::uint32_t>(i * i));
    pixels.record(Aov::albedo, i, Rgb{0.5F, value, 0});
  }
  auto film = std::make_unique<Film>(5, 3, aovs, std::vector{rect});
  film->store(0, pixels);
  return film;
}

struct Folders {
  TemporaryFolder images, aside;
  ImageStore store{images.path(), aside.path()};
  std::filesystem::path file() const { return images.path() / "a.film"; }
};

TEST(ImageStore, HasWhatWasKept) {
  const Folders folders;
  const auto film = film_with_planes();
  EXPECT_FALSE(folders.store.has("a"));
  EXPECT_EQ(folders.store.load("a"), nullptr);
  folders.store.keep("a", *film);
  EXPECT_TRUE(folders.store.has("a"));
  EXPECT_EQ(folders.images.file_count(), 1U);
  const auto loaded = folders.store.load("a");
  ASSERT_TRUE(loaded);
  EXPECT_TRUE(same_bytes(loaded->pixels(), film->pixels()));
  EXPECT_EQ(loaded->pixels().aovs(), film->pixels().aovs());
  EXPECT_EQ(loaded->versions(), std::vector<std::uint32_t>{1});
  folders.store.remove("a");
  EXPECT_FALSE(folders.store.has("a"));
  EXPECT_EQ(folders.aside.file_count(), 0U);
}

TEST(ImageStore, SetsAsideWhatIsDamaged) {
  const Folders folders;
  const auto film = film_with_planes();
  folders.store.keep("a", *film);
  const auto size = std::filesystem::file_size(folders.file());
  // Every byte counts, and so does the size.
  for (std::uintmax_t at = 0; at < size; ++at) {
    {
      std::fstream file(folders.file(), std::ios::binary | std::ios::in | std::ios::out);
      file.seekg(static_cast<std::streamoff>(at));
      const auto byte = static_cast<char>(file.get() ^ 1);
      file.seekp(static_cast<std::streamoff>(at));
      file.put(byte);
    }
    EXPECT_EQ(folders.store.load("a"), nullptr) << at;
    EXPECT_FALSE(folders.store.has("a")) << at;
    EXPECT_EQ(folders.aside.file_count(), 1U);
    folders.store.keep("a", *film);
  }
  for (const std::uintmax_t length : {std::uintmax_t{0}, std::uintmax_t{10}, size - 1, size + 1}) {
    std::filesystem::resize_file(folders.file(), length);
    EXPECT_EQ(folders.store.load("a"), nullptr) << length;
    folders.store.keep("a", *film);
  }
  EXPECT_TRUE(folders.store.load("a"));
}

}  // namespace
}  // namespace tessera::server
