#include "server/store/wide_store.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <span>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/accel/wide/wide_build.h"
#include "server/store/set_aside.h"
#include "server/store/wide_file.h"
#include "tests/support/meshes.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {
namespace fs = std::filesystem;

constexpr std::uint64_t kPlenty = 1 << 30;

bool same(const WideTree& a, const WideTree& b) {
  const auto same_bytes = [](auto x, auto y) { return std::ranges::equal(std::as_bytes(x), std::as_bytes(y)); };
  return a.root == b.root && same_bytes(a.nodes, b.nodes) && same_bytes(a.leaves, b.leaves) &&
         a.stats.bytes == b.stats.bytes && a.stats.nodes == b.stats.nodes && a.stats.leaves == b.stats.leaves &&
         a.stats.depth == b.stats.depth;
}

class WideStoreTest : public testing::Test {
 protected:
  fs::path folder() const { return temporary_.path() / "made" / "here"; }
  fs::path set_aside() const { return temporary_.path() / "set-aside"; }
  fs::path file_of(const TriangleMesh& mesh) const { return folder() / (wide_key(mesh) + ".wide"); }

  /// Whether a new daemon finds the mesh; what it has is what would be built, in any case.
  bool finds(const TriangleMesh& mesh, std::uint64_t limit = kPlenty) const {
    const MadeTree made = WideStore(folder(), set_aside(), limit, 1, 0).get(mesh);
    EXPECT_TRUE(same(made.tree, build_wide(mesh)));
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(made.tree.nodes.data()) % 64, 0U);
    return made.was_kept;
  }

  void expect_replaced(const TriangleMesh& mesh, const std::string& contents, const std::string& what) const {
    std::ofstream(file_of(mesh), std::ios::binary) << contents;
    const std::uint64_t before = files_set_aside();
    EXPECT_FALSE(finds(mesh)) << what;
    EXPECT_EQ(files_set_aside(), before + 1) << what;
    EXPECT_TRUE(finds(mesh)) << what;
  }

  TemporaryFolder temporary_;
};

TEST_F(WideStoreTest, BuildsAMeshOnce) {
  for (const TriangleMesh& mesh : {icosphere(0), icosphere(4), grid_plane(30), TriangleMesh{}}) {
    EXPECT_FALSE(finds(mesh));
    EXPECT_TRUE(finds(mesh));
  }
}

TEST_F(WideStoreTest, TellsMeshesApart) {
  const TriangleMesh mesh = icosphere(1);
  EXPECT_FALSE(finds(mesh));
  TriangleMesh moved = mesh, turned = mesh, shorter = mesh, shaded = mesh;
  moved.positions[3].x = std::nextafter(moved.positions[3].x, 9.0F);
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  shorter.triangles.pop_back();
  shaded.normals = mesh.positions;
  for (const TriangleMesh& other : {moved, turned, shorter}) EXPECT_FALSE(finds(other));
  EXPECT_TRUE(finds(shaded)) << "rays don't meet normals";
}

TEST_F(WideStoreTest, BuildsAgainWhateverIsWrongWithAFile) {
  const TriangleMesh mesh = icosphere(0);
  EXPECT_FALSE(finds(mesh));
  std::ifstream in(file_of(mesh), std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  ASSERT_EQ(whole.size(), wide_file_bytes(build_wide(mesh)));
  for (std::size_t at = 0; at < whole.size(); at += at < 256 ? 1 : 37) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    expect_replaced(mesh, damaged, "byte " + std::to_string(at));
  }
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1}, std::size_t{255}, std::size_t{256}, whole.size() - 4, whole.size() - 1})
    expect_replaced(mesh, whole.substr(0, size), std::to_string(size) + " bytes");
  expect_replaced(mesh, whole + "more", "longer");
  expect_replaced(mesh, whole + whole, "twice");
  const TriangleMesh other = icosphere(1);
  EXPECT_FALSE(finds(other));
  fs::rename(file_of(other), file_of(mesh));
  EXPECT_FALSE(finds(mesh)) << "another mesh's";
  EXPECT_TRUE(finds(mesh));
}

TEST_F(WideStoreTest, ScrubsAllFiles) {
  const TriangleMesh a = icosphere(1), b = icosphere(2);
  EXPECT_FALSE(finds(a));
  EXPECT_FALSE(finds(b));
  std::ofstream(folder() / "upload") << "not ours";
  const WideStore store(folder(), set_aside(), kPlenty, 1, 0);
  std::vector<fs::path> damaged;
  const auto note = [&](const fs::path& file) { damaged.push_back(file); };
  EXPECT_EQ(store.scrub(note).damaged, 0U);
  std::ofstream(file_of(b), std::ios::app) << 'x';
  EXPECT_EQ(store.scrub(note).files, 2U);
  EXPECT_EQ(damaged, std::vector{file_of(b)});
  EXPECT_TRUE(fs::exists(set_aside() / ("here-" + file_of(b).filename().string())));
  EXPECT_EQ(store.scrub(note).files, 1U);
}

TEST_F(WideStoreTest, DoesWithoutADiskThatRefuses) {
  const TriangleMesh mesh = icosphere(1);
  const WideStore store(folder(), set_aside(), kPlenty, 1, 0);
  fs::create_directory(file_of(mesh));
  EXPECT_TRUE(same(store.get(mesh).tree, build_wide(mesh))) << "a folder is in the way";
  fs::remove(file_of(mesh));
  ASSERT_EQ(::mkfifo(file_of(mesh).c_str(), 0600), 0);
  EXPECT_TRUE(same(store.get(mesh).tree, build_wide(mesh))) << "a pipe is in the way";
  fs::remove_all(folder());
  EXPECT_TRUE(same(store.get(mesh).tree, build_wide(mesh))) << "it is gone";
}

TEST_F(WideStoreTest, DropsWhatWasUsedLongestAgo) {
  const TriangleMesh a = icosphere(2), b = icosphere(2, 2), c = icosphere(2, 3);
  const std::uint64_t each = wide_file_bytes(build_wide(a)), limit = each * 5 / 2;
  EXPECT_FALSE(finds(a, limit));
  EXPECT_FALSE(finds(b, limit));
  const auto hours_ago = [](int hours) { return fs::file_time_type::clock::now() - std::chrono::hours(hours); };
  fs::last_write_time(file_of(a), hours_ago(2));
  fs::last_write_time(file_of(b), hours_ago(1));
  EXPECT_TRUE(finds(a, limit));
  EXPECT_FALSE(finds(c, limit));
  EXPECT_FALSE(fs::exists(file_of(b)));
  EXPECT_TRUE(finds(a, limit));
  EXPECT_TRUE(finds(c, limit));
  const fs::path upload = folder() / wide_key(b);  // as blobs are named
  std::ofstream(upload) << std::string(limit, 'x');
  fs::last_write_time(upload, hours_ago(3));
  EXPECT_FALSE(finds(b, limit));
  EXPECT_TRUE(fs::exists(upload)) << "not a hierarchy";
  EXPECT_TRUE(finds(b, limit));
  EXPECT_FALSE(finds(icosphere(4), limit));
  EXPECT_FALSE(fs::exists(file_of(icosphere(4)))) << "larger than all that is kept";
  EXPECT_TRUE(finds(b, limit));
}

TEST_F(WideStoreTest, KeepsNoSmallMeshes) {
  const TriangleMesh small = icosphere(4), large = icosphere(5);
  ASSERT_LT(small.triangles.size(), WideStore::kWorthKeeping);
  ASSERT_GE(large.triangles.size(), WideStore::kWorthKeeping);
  const WideStore store(folder(), set_aside(), kPlenty, 1);
  EXPECT_TRUE(same(store.get(small).tree, build_wide(small)));
  EXPECT_TRUE(same(store.get(large).tree, build_wide(large)));
  EXPECT_FALSE(store.get(small).was_kept);
  EXPECT_TRUE(store.get(large).was_kept);
  EXPECT_FALSE(fs::exists(file_of(small)));
}

TEST_F(WideStoreTest, RemovesWhatWasLeftHalfWritten) {
  fs::create_directories(folder());
  const fs::path old = folder() / ".receiving-a", fresh = folder() / ".receiving-b", foreign = folder() / "c";
  for (const fs::path& path : {old, fresh, foreign}) std::ofstream(path) << "half";
  for (const fs::path& path : {old, foreign})
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(2));
  const WideStore store(folder(), set_aside(), kPlenty, 1);
  EXPECT_FALSE(fs::exists(old));
  EXPECT_TRUE(fs::exists(fresh)) << "another daemon may be writing it";
  EXPECT_TRUE(fs::exists(foreign));
}

TEST_F(WideStoreTest, WhatIsInUseIsNoneOfItsFilesBusiness) {
  const TriangleMesh mesh = icosphere(3);
  EXPECT_FALSE(finds(mesh));
  const MadeTree made = WideStore(folder(), set_aside(), kPlenty, 1, 0).get(mesh);
  ASSERT_TRUE(made.was_kept);
  {
    std::fstream file(file_of(mesh), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(400);
    file << std::string(1000, 'x');
  }
  EXPECT_TRUE(same(made.tree, build_wide(mesh))) << "written into";
  fs::resize_file(file_of(mesh), 300);
  EXPECT_TRUE(same(made.tree, build_wide(mesh))) << "cut short";
  fs::remove_all(folder());
  EXPECT_TRUE(same(made.tree, build_wide(mesh))) << "gone";
}

TEST_F(WideStoreTest, ServesManyAtOnce) {
  const TriangleMesh mesh = icosphere(2);
  const WideTree known = build_wide(mesh);
  const WideStore one(folder(), set_aside(), kPlenty, 1, 0), other(folder(), set_aside(), wide_file_bytes(known), 1, 0);
  std::vector<std::jthread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&, i] {
      for (int round = 0; round < 20; ++round) {
        if (i == 0) std::ofstream(folder() / "a", std::ios::binary) << "in the way";
        EXPECT_TRUE(same((i % 2 ? one : other).get(mesh).tree, known));
        if (i == 1) other.get(icosphere(1, static_cast<float>(round + 1)));
      }
    });
}

}  // namespace
}  // namespace tessera::server
