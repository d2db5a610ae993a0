#include "server/isolation/isolated_reader.h"

#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/io/read_texture.h"
#include "proto/import/flat_import.h"
#include "server/isolation/read_requests.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

namespace fs = std::filesystem;
using proto::AssetReader;
using proto::Imported;
using proto::Result;

constexpr std::uint64_t kPlenty = 1 << 28;

Result<Imported> read(const AssetReader& reader, const fs::path& path, std::optional<proto::FileFormat> format = {},
                      std::uint64_t most_bytes = kPlenty) {
  const auto beside = [&](std::string_view name) -> std::optional<proto::InputFile> {
    const fs::path file = path.parent_path() / name;
    if (!fs::is_regular_file(file)) return std::nullopt;
    return file;
  };
  return reader.import(path, format ? *format : *proto::format_of(path.filename().string()), "shown", beside, {}, {},
                       most_bytes);
}

std::string bytes_of(const proto::FlatWriter& writer) {
  std::string bytes;
  writer.finish([&](std::span<const std::byte> piece) {
    bytes.append(reinterpret_cast<const char*>(piece.data()), piece.size());
  });
  return bytes;
}

/// All but the textures' images.
std::string flat(Result<Imported> imported) {
  if (imported) imported->textures.clear();
  proto::FlatWriter writer;
  std::vector<std::span<const std::byte>> images;
  flatten_import(imported, writer, images);
  return bytes_of(writer);
}

void expect_equal_textures(const std::vector<Texture>& a, const std::vector<Texture>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_EQ(a[i].transform, b[i].transform);
    EXPECT_EQ(a[i].is_srgb, b[i].is_srgb);
    EXPECT_EQ(a[i].wrap_u, b[i].wrap_u);
    EXPECT_EQ(a[i].image->bytes(), b[i].image->bytes());
    const Texels &x = a[i].image->texels(), &y = b[i].image->texels();
    EXPECT_EQ(x.width, y.width);
    EXPECT_EQ(x.height, y.height);
    EXPECT_EQ(x.channels, y.channels);
    EXPECT_EQ(x.values, y.values);
    EXPECT_EQ(a[i].image->problem(), b[i].image->problem());
  }
}

class IsolatedReaderTest : public testing::Test {
 protected:
  void expect_same(const fs::path& path) {
    const auto alone = read(reader_, path), here = read(proto::direct_reader(), path);
    ASSERT_EQ(static_cast<bool>(alone), static_cast<bool>(here))
        << path << (alone ? here : alone).problem().detail
        << ((alone ? here : alone).problem().errors.empty() ? "" : (alone ? here : alone).problem().errors[0].detail);
    EXPECT_EQ(flat(alone), flat(here)) << path;
    if (alone) expect_equal_textures(alone->textures, here->textures);
  }

  const TemporaryFolder folder_;
  const Isolation isolation_{read_in_worker, load_image_library};
  const IsolatedReader reader_{isolation_, 60};
};

TEST_F(IsolatedReaderTest, AModelAndItsLibraryComeOverWhole) {
  folder_.write("a.mtl", "newmtl red\nKd 1 0 0\nmap_Kd missing.png\n");
  folder_.write("a.obj", "mtllib a.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 1 2\n");
  expect_same(folder_.path() / "a.obj");
  const auto imported = read(reader_, folder_.path() / "a.obj");
  ASSERT_TRUE(imported);
  ASSERT_EQ(imported->parts.size(), 1U);
  EXPECT_EQ(std::get<TriangleMesh>(imported->parts[0].shape).triangles.size(), 1U);
  EXPECT_FALSE(imported->warnings.empty());
}

TEST_F(IsolatedReaderTest, ProblemsAreTheSameWithTheirPlaces) {
  folder_.write("a.ply", "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nend_header\n1\n");
  expect_same(folder_.path() / "a.ply");
  EXPECT_EQ(read(reader_, folder_.path() / "a.ply").problem().errors.at(0).pointer.substr(0, 5), "shown");
  expect_same(folder_.path() / "missing.ply");
}

TEST_F(IsolatedReaderTest, EveryFileOfTheCorpusComesOutAsInThisProcess) {
  std::size_t files = 0;
  for (const char* folder : {"importer-corpus", "meshes", "gltf"}) {
    const auto data = shared_data();
    const fs::path root = data ? *data / folder : fs::path();
    if (!fs::is_directory(root)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root)) {
      if (!entry.is_regular_file() || entry.file_size() > 4 << 20) continue;
      if (!proto::format_of(entry.path().filename().string())) continue;
      expect_same(entry.path());
      ++files;
    }
  }
  if (files == 0) GTEST_SKIP() << "no shared data";
}

/// What a worker replies to a request for a model, whatever that is.
proto::Problem problem_of(const ReadReply& reply) {
  const Isolation isolation([reply](const Worker& worker, const Message&) { worker.done(encoded(reply)); }, [] {});
  const TemporaryFolder folder;
  const auto read_model = read(IsolatedReader(isolation, 60), folder.write("a.obj", "v 0 0 0\n"));
  return read_model ? proto::Problem{} : read_model.problem();
}

TEST(IsolatedReader, WhatIsTheFilesFaultIsToldFromWhatIsNot) {
  const auto too_much = problem_of({.is_beyond_allowance = true});
  EXPECT_EQ(too_much.code, proto::ProblemCode::invalid_document);
  ASSERT_EQ(too_much.errors.size(), 1U);
  EXPECT_EQ(too_much.errors[0].pointer, "shown");
  EXPECT_NE(too_much.errors[0].detail.find("more memory than it may"), std::string::npos);
  EXPECT_EQ(problem_of({.is_out_of_memory = true}).code, proto::ProblemCode::out_of_memory_budget);
  EXPECT_EQ(problem_of({.missing_library = "It isn't there."}).code, proto::ProblemCode::internal_error);
  EXPECT_EQ(problem_of({}).code, proto::ProblemCode::invalid_document) << "an outcome of no bytes";
}

TEST(IsolatedReader, AProcessThatCrashesIsNamed) {
  const Isolation isolation([](const Worker&, const Message&) { ::_exit(1); }, [] {});
  const TemporaryFolder folder;
  const auto crashed = read(IsolatedReader(isolation, 60), folder.write("a.obj", "v 0 0 0\n"));
  ASSERT_FALSE(crashed);
  EXPECT_EQ(crashed.problem().code, proto::ProblemCode::invalid_document);
  EXPECT_EQ(crashed.problem().detail, "shown can't be imported.");
  ASSERT_EQ(crashed.problem().errors.size(), 1U);
  EXPECT_EQ(crashed.problem().errors[0].pointer, "shown");
}

TEST(IsolatedReader, WhereThereCanBeNoProcessThatIsNoFaultOfTheFile) {
  const Isolation isolation([](const Worker& worker, const Message&) { worker.ask(std::to_string(::getppid())); },
                            [] {});
  pid_t zygote = 0;
  (void)isolation.run({Isolation::Preparation::bare, "", {}, std::chrono::seconds(20)}, {}, [&](std::string_view pid) {
    zygote = std::stoi(std::string(pid));
    return Isolation::Answer{};
  });
  ASSERT_GT(zygote, 1);
  ::kill(zygote, SIGKILL);
  while (isolation.problem().empty()) std::this_thread::yield();
  const TemporaryFolder folder;
  const auto refused = read(IsolatedReader(isolation, 60), folder.write("a.obj", "v 0 0 0\n"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.problem().code, proto::ProblemCode::reader_unavailable);
}

/// A worker that was taken over may say anything.
TEST_F(IsolatedReaderTest, NothingIsBelieved) {
  folder_.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto here = read(proto::direct_reader(), folder_.path() / "a.obj");
  proto::FlatWriter writer;
  std::vector<std::span<const std::byte>> images;
  flatten_import(here, writer, images);
  const std::string good = bytes_of(writer);
  const auto unflatten = [](const std::string& bytes) {
    return proto::unflatten_import(std::as_bytes(std::span(bytes)),
                                   [](const proto::FlatImage&) { return std::shared_ptr<const TextureImage>(); });
  };
  ASSERT_TRUE(unflatten(good));
  const auto check = [](const Result<Imported>& read) {
    if (!read) return;
    for (const auto& part : read->parts) {
      const auto* mesh = std::get_if<TriangleMesh>(&part.shape);
      if (mesh == nullptr) continue;
      for (const TriangleIndices& t : mesh->triangles)
        for (const std::uint32_t corner : t) EXPECT_LT(corner, mesh->positions.size());
    }
  };
  std::size_t refused = 0;
  for (std::size_t i = 0; i < good.size(); ++i)
    for (const char other : {'\0', '\1', '\x7f', '\xff'}) {
      std::string bad = good;
      bad[i] = other;
      try {
        check(unflatten(bad));
      } catch (const proto::NotFlat&) {
        ++refused;
      }
    }
  EXPECT_GT(refused, good.size() / 2);
  for (std::size_t size = 0; size + proto::FlatWriter::kAlignment < good.size(); ++size)  // The rest is padding.
    EXPECT_THROW(unflatten(good.substr(0, size)), proto::NotFlat);
}

}  // namespace
}  // namespace tessera::server
