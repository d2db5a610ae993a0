#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <string_view>

#include "proto/import/input_file.h"
#include "proto/wire/file_kind.h"

namespace tessera::proto {

/// A whole file's bytes. Throws `BrokenFile` with `name` when it can't be read or is larger than `limit`,
/// `Abandoned` when a stop is requested before its end.
std::string read_file(const InputFile& file, std::string_view name, std::uintmax_t limit,
                      const std::stop_token& stop = {});

/// What kind of file that is; `unknown` when it can't be read.
FileKind kind_of(const InputFile& file);

}  // namespace tessera::proto
