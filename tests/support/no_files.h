#pragma once

#include "proto/file_source.h"

namespace tessera::proto {

/// For documents that name no files: there are none.
class NoFiles : public FileSource {
 public:
  Result<SourceFile> blob(const ContentHash&, const std::stop_token&) const override {
    return Problem{ProblemCode::not_found, "No blob has this hash.", {}};
  }
  Result<SourceFile> asset(std::string_view, const std::stop_token&) const override {
    return Problem{ProblemCode::not_found, "There is no such file.", {}};
  }
  const AssetReader& reader() const override { return direct_reader(); }
};

}  // namespace tessera::proto
