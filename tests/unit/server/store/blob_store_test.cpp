#include "server/store/blob_store.h"

#include <span>
#include <stdexcept>
#include <system_error>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

namespace fs = std::filesystem;
using proto::content_hash;
using proto::ProblemCode;

std::unique_ptr<ReceivedFile> received(const BlobStore& store, std::string_view text) {
  auto file = store.receive();
  file->write(std::as_bytes(std::span(text.substr(0, 2))));
  file->write(std::as_bytes(std::span(text.substr(2))));
  return file;
}

TEST(BlobStore, KeepsAFileByItsHash) {
  const TemporaryFolder folder;
  BlobStore store(folder.path(), folder.path() / "set-aside", std::nullopt, proto::direct_reader());
  const auto hash = content_hash("some bytes");
  EXPECT_FALSE(store.blob(hash));
  const auto file = received(store, "some bytes");
  EXPECT_EQ(file->size(), 10U);
  EXPECT_EQ(*store.put(hash, *file), BlobStore::Put::created);
  EXPECT_EQ(*store.put(hash, *received(store, "some bytes")), BlobStore::Put::known);
  const auto found = store.blob(hash);
  ASSERT_TRUE(found);
  EXPECT_EQ(proto::hash_file(found->path), hash);
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(BlobStore, WhatWasReadOfAFileIsAllOfIt) {
  const TemporaryFolder folder;
  const BlobStore store(folder.path(), folder.path() / "set-aside", std::nullopt, proto::direct_reader());
  const auto read = [](int how, ReceivedFile& file) {
    if (how == 0) file.finish();
    if (how == 1) file.content();
    if (how == 2) file.path();
  };
  for (const int how : {0, 1, 2}) {
    const auto file = received(store, "some bytes");
    EXPECT_EQ(file->head(4), "some");
    read(how, *file);
    EXPECT_THROW(file->write(std::as_bytes(std::span("more", 4))), std::logic_error);
    EXPECT_EQ(file->finish(), content_hash("some bytes"));
    EXPECT_EQ(file->content(), "some bytes");
    EXPECT_EQ(proto::hash_file(file->path()), content_hash("some bytes"));
  }
}

TEST(BlobStore, RefusesAnotherHashAndLeavesNothing) {
  const TemporaryFolder folder;
  BlobStore store(folder.path(), folder.path() / "set-aside", std::nullopt, proto::direct_reader());
  EXPECT_EQ(store.put(content_hash("some bytes"), *received(store, "other bytes")).problem().code,
            ProblemCode::hash_mismatch);
  EXPECT_EQ(folder.file_count(), 0U);
  EXPECT_FALSE(store.blob("sha256:../../etc/passwd"));
}

TEST(BlobStore, AnUploadThatBreaksOffLeavesNothing) {
  const TemporaryFolder folder;
  const BlobStore store(folder.path(), folder.path() / "set-aside", std::nullopt, proto::direct_reader());
  received(store, "some bytes");
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(BlobStore, ADamagedBlobIsAsIfItWerentThereUntilItIsPutAgain) {
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "blobs");
  const auto hash = content_hash("some bytes");
  const auto path = folder.path() / "blobs" / hash_digits(hash);
  const auto open = [&] {
    return BlobStore(folder.path() / "blobs", folder.path() / "set-aside", std::nullopt, proto::direct_reader());
  };
  {
    BlobStore store = open();
    ASSERT_TRUE(store.put(hash, *received(store, "some bytes")));
    ASSERT_TRUE(store.blob(hash));
    folder.write("blobs/" + hash_digits(hash), "some bytez");  // While it runs, and knows the blob already,
    EXPECT_NE(store.blob(hash).problem().detail.find("damaged"), std::string::npos);
    EXPECT_EQ(*store.put(hash, *received(store, "some bytes")), BlobStore::Put::created);
    EXPECT_TRUE(store.blob(hash));
  }
  folder.write("blobs/" + hash_digits(hash), "some byte");  // between runs,
  {
    BlobStore store = open();
    EXPECT_NE(store.blob(hash).problem().detail.find("damaged"), std::string::npos);
    EXPECT_FALSE(fs::exists(path));
  }
  {
    BlobStore store = open();
    EXPECT_NE(store.blob(hash).problem().detail.find("damaged"), std::string::npos) << "it is remembered";
    ASSERT_TRUE(store.put(hash, *received(store, "some bytes")));
  }
  folder.write("blobs/" + hash_digits(hash), "some bytes and more");  // and before it is put again.
  BlobStore store = open();
  EXPECT_EQ(*store.put(hash, *received(store, "some bytes")), BlobStore::Put::created);
  EXPECT_EQ(proto::hash_file(store.blob(hash)->path), hash);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path() / "set-aside"), {}), 3);
}

TEST(Assets, AreFoundUnderTheRootOnly) {
  const TemporaryFolder blobs, root, outside;
  fs::create_directories(root.path() / "a" / "b");
  root.write("a/b/file.obj", "text");
  const fs::path secret = outside.write("secret.obj", "secret");
  fs::create_symlink(secret, root.path() / "link.obj");
  fs::create_symlink(outside.path(), root.path() / "folder");
  fs::create_symlink(root.path() / "a", root.path() / "inner");
  const BlobStore store(blobs.path(), blobs.path() / "set-aside", root.path(), proto::direct_reader());

  for (const char* path : {"a/b/file.obj", "./a//b/file.obj", "inner/b/file.obj"}) {
    const auto found = store.asset(path);
    ASSERT_TRUE(found) << path;
    EXPECT_EQ(found->hash, content_hash("text"));
  }
  const std::string climbing = "../" + outside.path().filename().string() + "/secret.obj";
  for (const std::string& path : {secret.string(), climbing, std::string("a/../a/b/file.obj"), std::string("link.obj"),
                                  std::string("folder/secret.obj"), std::string("a"), std::string("."), std::string(),
                                  std::string("none.obj"), std::string("a/b/file.obj\0x", 14)})
    EXPECT_EQ(store.asset(path).problem().code, ProblemCode::invalid_document) << path;
}

TEST(Assets, ASiblingWithALongerNameIsOutside) {
  const TemporaryFolder blobs, parent;
  fs::create_directories(parent.path() / "root");
  fs::create_directories(parent.path() / "rootless");
  parent.write("rootless/file.obj", "text");
  fs::create_symlink(parent.path() / "rootless" / "file.obj", parent.path() / "root" / "link.obj");
  const BlobStore store(blobs.path(), blobs.path() / "set-aside", parent.path() / "root", proto::direct_reader());
  EXPECT_FALSE(store.asset("link.obj"));
}

TEST(Assets, NeedARoot) {
  const TemporaryFolder blobs;
  const auto aside = blobs.path() / "set-aside";
  EXPECT_FALSE(BlobStore(blobs.path(), aside, std::nullopt, proto::direct_reader()).asset("file.obj"));
  EXPECT_THROW(BlobStore(blobs.path(), aside, blobs.path() / "none", proto::direct_reader()), std::system_error);
}

}  // namespace
}  // namespace tessera::server
