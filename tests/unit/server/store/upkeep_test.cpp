#include "server/store/upkeep.h"

#include <chrono>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include <gtest/gtest.h>

#include "server/store/data_folder.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {
namespace fs = std::filesystem;

constexpr std::string_view kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

class UpkeepTest : public testing::Test {
 protected:
  UpkeepTest()
      : folder_(data_.path()),
        blobs_(folder_.blobs(), folder_.set_aside(), std::nullopt, proto::direct_reader()),
        scenes_(folder_.scenes(), folder_.set_aside(), blobs_, {}, 1 << 20),
        blob_(proto::content_hash(kObj)) {
    const auto file = blobs_.receive();
    file->write(std::as_bytes(std::span(kObj)));
    EXPECT_TRUE(blobs_.put(blob_, *file));
    auto put =
        scenes_.put(R"({"objects": [{"type": "file", "blob": ")" + blob_ + R"(", "format": "obj"}]})", blobs_, {});
    EXPECT_TRUE(put);
    scene_ = *put;
    age(blobs_.shelf(), blob_);
    age(scenes_.shelf(), scene_->scene.hash);
  }

  static void age(Shelf& shelf, const proto::ContentHash& hash) {
    fs::last_write_time(shelf.path_of(hash_digits(hash)), fs::file_time_type::clock::now() - std::chrono::hours(2));
  }
  bool has_blob() { return fs::exists(blobs_.shelf().path_of(hash_digits(blob_))); }
  void sweep(std::chrono::hours blobs, std::chrono::hours scenes) {
    Upkeep::sweep(blobs_, scenes_, owners_, {{.age = blobs}, {.age = scenes}}, {});
  }

  TemporaryFolder data_;
  DataFolder folder_;
  BlobStore blobs_;
  SceneStore scenes_;
  Owners owners_{folder_.owners()};
  const proto::ContentHash blob_;
  std::optional<SceneStore::Put> scene_;
};

TEST_F(UpkeepTest, WhatASceneNamesStaysAsLongAsTheScene) {
  const proto::ContentHash hash = scene_->scene.hash;
  scene_.reset();
  sweep(std::chrono::hours(1), std::chrono::hours(3));
  EXPECT_TRUE(has_blob());
  EXPECT_TRUE(scenes_.find(hash, {}));
  age(scenes_.shelf(), hash);
  sweep(std::chrono::hours(1), std::chrono::hours(1));
  EXPECT_FALSE(has_blob()) << "both at once";
  EXPECT_EQ(scenes_.find(hash, {}).problem().code, proto::ProblemCode::gone) << "though it was in memory";
}

TEST_F(UpkeepTest, WhatGoesGivesItsBytesBack) {
  const proto::ContentHash hash = scene_->scene.hash;
  owners_.add("me", hash, 100);
  owners_.add("me", blob_, 10);
  sweep(std::chrono::hours(1), std::chrono::hours(1));
  EXPECT_EQ(owners_.bytes_of("me"), 110U) << "the scene is in use";
  scene_.reset();
  sweep(std::chrono::hours(1), std::chrono::hours(1));
  EXPECT_EQ(owners_.bytes_of("me"), 0U);
  EXPECT_TRUE(owners_.has("me", hash)) << "who had it is told that it has expired";
  const Owners next(folder_.owners());
  EXPECT_TRUE(next.has("me", blob_));
  EXPECT_EQ(next.bytes_of("me"), 0U);
  owners_.add("me", blob_, 10);
  EXPECT_EQ(owners_.bytes_of("me", blob_), 10U) << "it was sent again";
  EXPECT_EQ(Owners(folder_.owners()).bytes_of("me"), 10U);
}

TEST_F(UpkeepTest, AHeldSceneStays) {
  sweep(std::chrono::hours(1), std::chrono::hours(1));
  EXPECT_TRUE(has_blob());
  scene_.reset();
  sweep(std::chrono::hours(1), std::chrono::hours(1));
  EXPECT_FALSE(has_blob());
}

TEST_F(UpkeepTest, BeginsAndEndsAtOnce) {
  scene_.reset();
  { const Upkeep none(blobs_, scenes_, owners_, {}); }
  EXPECT_TRUE(has_blob()) << "no limits";
}

}  // namespace
}  // namespace tessera::server
