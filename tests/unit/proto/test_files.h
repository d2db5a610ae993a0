#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "proto/file_source.h"
#include "tests/support/no_files.h"

namespace tessera::proto {

/// Files for scenes of a test: assets in a folder of its own, blobs by hash.
class TestFiles : public FileSource {
 public:
  TestFiles()
      : root_(std::filesystem::path(testing::TempDir()) /
              ("tessera_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::filesystem::remove_all(root_);
    std::filesystem::create_directories(root_);
  }
  ~TestFiles() override { std::filesystem::remove_all(root_); }

  void add_asset(std::string_view path, std::string_view content) {
    std::filesystem::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path, std::ios::binary) << content;
  }

  ContentHash add_blob(std::string_view content) {
    const ContentHash hash = content_hash(content);
    blobs_[hash] = root_ / ("blob-" + hash.substr(7));
    std::ofstream(blobs_[hash], std::ios::binary) << content;
    return hash;
  }

  Result<SourceFile> blob(const ContentHash& hash, const std::stop_token&) const override {
    const auto found = blobs_.find(hash);
    if (found == blobs_.end()) return Problem{ProblemCode::not_found, "No blob has this hash.", {}};
    return SourceFile{found->second, hash};
  }

  Result<SourceFile> asset(std::string_view relative_path, const std::stop_token& stop) const override {
    const auto normal = std::filesystem::path(relative_path).lexically_normal();
    if (normal.is_absolute() || normal.begin()->string() == "..") {
      return Problem{ProblemCode::invalid_document, "The path leaves the asset root.", {}};
    }
    const auto hash = hash_file(root_ / normal, stop);
    if (!hash) return Problem{ProblemCode::not_found, "There is no such file.", {}};
    return SourceFile{root_ / normal, *hash};
  }

  const AssetReader& reader() const override { return direct_reader(); }

 private:
  std::filesystem::path root_;
  std::map<ContentHash, std::filesystem::path> blobs_;
};

}  // namespace tessera::proto
