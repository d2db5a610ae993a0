#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/problem.h"

namespace tessera::proto {

/// What the readers of proto/import throw when a file can't be read; `import_file` turns it into a problem, so it
/// never leaves that folder.
struct BrokenFile {
  std::vector<FieldError> errors;
};

/// "name:line", the pointer of errors and warnings in a file; `name` alone for line 0 (binary, or the whole file).
inline std::string file_place(std::string_view name, std::size_t line) {
  return line == 0 ? std::string(name) : std::string(name) + ':' + std::to_string(line);
}

}  // namespace tessera::proto
