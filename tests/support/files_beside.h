#pragma once

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "proto/file_source.h"

namespace tessera {

/// The files in a folder, for documents that name them by paths from there; there are no blobs.
class FilesBeside final : public proto::FileSource {
 public:
  explicit FilesBeside(std::filesystem::path folder) : folder_(std::move(folder)) {}

  proto::Result<proto::SourceFile> blob(const proto::ContentHash&, const std::stop_token&) const override {
    throw std::logic_error("a blob");
  }
  proto::Result<proto::SourceFile> asset(std::string_view name, const std::stop_token&) const override {
    const auto hash = proto::hash_file(folder_ / name);
    if (!hash) return proto::Problem{proto::ProblemCode::not_found, "There is no such file.", {}};
    return proto::SourceFile{folder_ / name, *hash};
  }
  const proto::AssetReader& reader() const override { return proto::direct_reader(); }

 private:
  std::filesystem::path folder_;
};

}  // namespace tessera
