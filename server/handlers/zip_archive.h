#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/result.h"
#include "server/store/received_file.h"

namespace tessera::server {

/// A file that came with others.
struct NamedFile {
  std::string name;          ///< A path, as `why_unsafe` lets it pass.
  std::string content_type;  ///< Empty where nothing is said of it.
  std::shared_ptr<ReceivedFile> file;
};

/// What is wrong with a name that others gave to a file, in words; empty for a relative path that stays where it is:
/// with slashes, without "..", drives or control characters, and not too long.
std::string why_unsafe(std::string_view name);

/// A name that others gave to a file, as `why_unsafe` judges it: with slashes where Windows has backslashes.
std::string with_slashes(std::string name);

/// Where files are put.
using NewFile = std::function<std::shared_ptr<ReceivedFile>()>;

/// The files of a ZIP archive, through libarchive. `payload_too_large` where they are more than `kMostFiles`, larger
/// than `most_bytes` together, or so much larger than the archive that it is made to fill memory (RFC 1951 can't do
/// more than 1032 times); `malformed_request` for a broken archive, one that is encrypted, links, names that are unsafe
/// or come twice, and methods of compression other than deflate, whose memory isn't bounded as deflate's is. Throws
/// `Abandoned` soon after `stop` is requested.
proto::Result<std::vector<NamedFile>> unpack_zip(std::string_view archive, std::uint64_t most_bytes,
                                                 const NewFile& new_file, const std::stop_token& stop);

inline constexpr std::size_t kMostFiles = 4096;

}  // namespace tessera::server
