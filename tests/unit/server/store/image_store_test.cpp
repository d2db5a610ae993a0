#include "server/store/image_store.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
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
  TemporaryFolder images, aside, data;
  Journal journal{data.path() / "journal.db"};
  ImageStore store{images.path(), aside.path(), journal};
  std::filesystem::path file() const { return images.path() / "a.film"; }
};

TEST(ImageStore, HasWhatWasKept) {
  const Folders folders;
  const auto film = film_with_planes();
  EXPECT_TRUE(folders.store.jobs().empty());
  EXPECT_EQ(folders.store.load("a"), nullptr);
  folders.store.keep("a", *film);
  EXPECT_EQ(folders.store.jobs(), std::set<std::string>{"a"});
  EXPECT_EQ(folders.images.file_count(), 1U);
  const auto loaded = folders.store.load("a");
  ASSERT_TRUE(loaded);
  EXPECT_TRUE(same_bytes(loaded->pixels(), film->pixels()));
  EXPECT_EQ(loaded->pixels().aovs(), film->pixels().aovs());
  EXPECT_EQ(loaded->versions(), std::vector<std::uint32_t>{1});
  folders.store.remove("a");
  EXPECT_TRUE(folders.store.jobs().empty());
  EXPECT_EQ(folders.aside.file_count(), 0U);
}

TEST(ImageStore, SetsAsideWhatIsDamaged) {
  const Folders folders;
  const auto film = film_with_planes();
  folders.store.keep("a", *film);
  std::ifstream file(folders.file(), std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(file), {}};
  const auto write = [&](const std::string& bytes) { std::ofstream(folders.file(), std::ios::binary) << bytes; };
  // Every byte counts, and so does the size.
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] ^= 1;
    write(changed);
    EXPECT_EQ(folders.store.load("a"), nullptr) << at;
    EXPECT_TRUE(folders.store.jobs().empty()) << at;
    EXPECT_EQ(folders.aside.file_count(), at + 1) << "and none is overwritten";
  }
  for (const std::size_t length : {std::size_t{0}, std::size_t{10}, whole.size() - 1, whole.size() + 1}) {
    std::string changed = whole;
    changed.resize(length);
    write(changed);
    EXPECT_EQ(folders.store.load("a"), nullptr) << length;
  }
  write(whole);
  EXPECT_TRUE(folders.store.load("a"));
}

/// An end with an image, and whether it is there for good.
void append(Journal& journal, const std::string& job, std::shared_ptr<const std::string> image) {
  std::promise<bool> is_written;
  Journal::Append entry{job, "completed", std::chrono::system_clock::now(), nullptr};
  entry.is_awaited = true;
  entry.image = std::move(image);
  entry.done = [&](const std::optional<proto::Problem>& problem, std::uint64_t) { is_written.set_value(!problem); };
  journal.append(std::move(entry));
  ASSERT_TRUE(is_written.get_future().get());
}

TEST(ImageStore, FindsSmallOnesInTheJournal) {
  Folders folders;
  const auto film = film_with_planes();
  const auto image = ImageStore::for_journal(*film);
  ASSERT_TRUE(image);
  append(folders.journal, "a", image);
  EXPECT_EQ(folders.store.jobs(), std::set<std::string>{"a"});
  const auto loaded = folders.store.load("a");
  ASSERT_TRUE(loaded);
  EXPECT_TRUE(same_bytes(loaded->pixels(), film->pixels()));
  EXPECT_EQ(folders.images.file_count(), 0U);
  std::string changed = *image;
  changed[changed.size() / 2] ^= 1;
  append(folders.journal, "a", std::make_shared<const std::string>(changed));
  EXPECT_EQ(folders.store.load("a"), nullptr);
  EXPECT_EQ(folders.aside.file_count(), 1U) << "what was damaged is kept for who runs the server";
  const PixelRect large{0, 0, 128, 128};
  EXPECT_FALSE(ImageStore::for_journal(Film(128, 128, {}, std::vector{large}))) << "it is a file";
}

}  // namespace
}  // namespace tessera::server
