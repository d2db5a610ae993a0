#pragma once

#include <memory>
#include <stop_token>
#include <string_view>
#include <vector>

#include "proto/file_source.h"

namespace tessera::server {

/// The same files, of which no blob goes as long as this lives once it has been asked for. For one thread.
class HeldFiles : public proto::FileSource {
 public:
  explicit HeldFiles(const proto::FileSource& files) : files_(files) {}

  proto::Result<proto::SourceFile> blob(const proto::ContentHash& hash, const std::stop_token& stop) const override {
    auto file = files_.blob(hash, stop);
    if (file) held_.push_back(file->hold);
    return file;
  }
  proto::Result<proto::SourceFile> asset(std::string_view relative_path, const std::stop_token& stop) const override {
    return files_.asset(relative_path, stop);
  }
  const proto::AssetReader& reader() const override { return files_.reader(); }

 private:
  const proto::FileSource& files_;
  mutable std::vector<std::shared_ptr<const void>> held_;
};

}  // namespace tessera::server
