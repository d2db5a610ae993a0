#include "server/store/scene_store.h"

#include <fstream>
#include <iterator>
#include <span>

#include <gtest/gtest.h>

#include "server/store/blob_store.h"
#include "server/store/data_folder.h"
#include "server/store/scene_file.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {
namespace fs = std::filesystem;
using proto::content_hash;
using proto::ContentHash;
using proto::ProblemCode;

constexpr const char* kTriangle =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
constexpr const char* kSphereScene = R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}]})";
/// The same, written otherwise.
constexpr const char* kSameScene = R"({"objects":[{"radius":1.0,"center":[0,0,0],"type":"sphere"}]})";

/// A daemon's stores.
struct Stores {
  explicit Stores(const fs::path& data)
      : folder(data),
        blobs(folder.blobs(), folder.set_aside(), std::nullopt, proto::direct_reader()),
        scenes(folder.scenes(), folder.set_aside(), blobs, {}, 1 << 20) {}

  proto::Result<SceneStore::Put> put(std::string_view document) { return scenes.put(document, blobs, {}); }

  DataFolder folder;
  BlobStore blobs;
  SceneStore scenes;
};

class SceneStoreTest : public testing::Test {
 protected:
  fs::path path_of(const ContentHash& hash) const { return data_.path() / "scenes" / (hash_digits(hash) + ".scene"); }

  /// Posts it to a daemon that ends then.
  ContentHash post(std::string_view document) const {
    const auto put = Stores(data_.path()).put(document);
    EXPECT_TRUE(put) << put.problem().detail;
    return put->scene.hash;
  }
  proto::Result<proto::ParsedScene> find(const ContentHash& hash) const {
    return Stores(data_.path()).scenes.find(hash, {});
  }

  TemporaryFolder data_;
};

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST_F(SceneStoreTest, KeepsDocumentsThatCanBeChecked) {
  const ContentHash hash = post(kSphereScene);
  EXPECT_EQ(find(hash)->hash, hash);
  const auto file = read_scene_file(path_of(hash));
  ASSERT_TRUE(file);
  EXPECT_EQ(file->document, kSphereScene);
  EXPECT_EQ(content_of(path_of(hash)), content_hash('\n' + std::string(kSphereScene)) + "\n\n" + kSphereScene);
  EXPECT_EQ(find(content_hash("")).problem().code, ProblemCode::not_found);
}

TEST_F(SceneStoreTest, EveryDamagedByteIsNoticedAndHealed) {
  const ContentHash hash = post(kSphereScene);
  const std::string whole = content_of(path_of(hash));
  for (std::size_t at = 0; at < whole.size(); at += 3) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    std::ofstream(path_of(hash), std::ios::binary) << damaged;
    if (at % 2 == 0) {  // Otherwise it is posted again before anybody has noticed.
      const auto found = find(hash);
      ASSERT_FALSE(found) << at;
      EXPECT_EQ(found.problem().code, ProblemCode::not_found);
      EXPECT_NE(found.problem().detail.find("damaged"), std::string::npos);
      EXPECT_FALSE(fs::exists(path_of(hash)));
    }
    EXPECT_FALSE(Stores(data_.path()).put(kSphereScene)->known);
    ASSERT_TRUE(find(hash)) << at;
    EXPECT_EQ(content_of(path_of(hash)), whole);
  }
}

TEST_F(SceneStoreTest, DamageWhileItRuns) {
  Stores stores(data_.path());
  const auto put = stores.put(kSphereScene);
  const ContentHash hash = put->scene.hash;
  EXPECT_TRUE(stores.put(kSphereScene)->known);
  fs::resize_file(path_of(hash), 100);
  EXPECT_TRUE(stores.scenes.find(hash, {})) << "from memory";
  EXPECT_FALSE(stores.put(kSphereScene)->known);
  EXPECT_TRUE(read_scene_file(path_of(hash)));
}

TEST_F(SceneStoreTest, AdoptsDocumentsOfEarlierVersions) {
  const ContentHash hash = post(kSphereScene), blob = content_hash("some bytes");
  fs::remove(path_of(hash));
  const std::string scenes = "scenes/";
  data_.write(scenes + hash_digits(hash) + ".json", kSphereScene);
  const std::string naming = content_hash("naming"), broken = content_hash("broken");
  data_.write(scenes + hash_digits(naming) + ".json", R"({"a": ")" + blob + R"("})");
  data_.write(scenes + hash_digits(broken) + ".json", "{\"objects\": [");
  data_.write("scenes/other.json", "{}");
  Stores stores(data_.path());
  EXPECT_TRUE(stores.scenes.find(hash, {}));
  EXPECT_TRUE(stores.scenes.names_blob(blob));
  EXPECT_EQ(stores.scenes.find(broken, {}).problem().code, ProblemCode::not_found);
  EXPECT_FALSE(fs::exists(path_of(broken))) << "it was damaged before";
  EXPECT_FALSE(fs::exists(data_.path() / "scenes" / (hash_digits(hash) + ".json")));
  EXPECT_TRUE(fs::exists(data_.path() / "scenes/other.json")) << "not ours";
}

TEST_F(SceneStoreTest, WhatIsWrittenOtherwiseTakesThePlaceOfWhatMayBeDamaged) {
  const ContentHash hash = post(kSphereScene);
  EXPECT_EQ(post(kSameScene), hash);
  EXPECT_EQ(read_scene_file(path_of(hash))->document, kSameScene);
}

TEST_F(SceneStoreTest, BlobsOfStoredScenesAreKnown) {
  Stores stores(data_.path());
  const ContentHash blob = content_hash(kTriangle);
  const auto file = stores.blobs.receive();
  file->write(std::as_bytes(std::span(std::string_view(kTriangle))));
  ASSERT_TRUE(stores.blobs.put(blob, *file));
  std::string escaped = blob;
  escaped.replace(0, 1, "\\u0073");
  const auto put = stores.put(R"({"objects": [{"type": "file", "blob": ")" + escaped + R"(", "format": "ply"}]})");
  ASSERT_TRUE(put) << put.problem().errors.at(0).detail;
  EXPECT_TRUE(stores.scenes.names_blob(blob));
  EXPECT_FALSE(stores.scenes.names_blob(content_hash("")));

  std::ofstream(data_.path() / "blobs" / hash_digits(blob), std::ios::app) << ' ';
  const auto found =
      SceneStore(stores.folder.scenes(), stores.folder.set_aside(), stores.blobs, {}, 0).find(put->scene.hash, {});
  EXPECT_EQ(found.problem().code, ProblemCode::invalid_document);
  EXPECT_NE(found.problem().errors.at(0).detail.find("damaged"), std::string::npos);
}

TEST(HashesNamedIn, AreThoseOfStrings) {
  const ContentHash a = content_hash("a"), b = content_hash("b");
  EXPECT_EQ(hashes_named_in("{\"x\": \"" + a + "\", \"y\": [\"" + a + "\", \"" + b + "\"]}").size(), 2U);
  EXPECT_EQ(hashes_named_in(R"({"x": "\u0073)" + a.substr(1) + "\"}"), std::vector{a});
  EXPECT_TRUE(hashes_named_in("{\"x\": \"sha256:abc\"}").empty());
  EXPECT_TRUE(hashes_named_in("").empty());
}

}  // namespace
}  // namespace tessera::server
