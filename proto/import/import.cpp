#include "proto/import/import.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <new>
#include <utility>

#include "proto/import/broken_file.h"
#include "proto/import/nff.h"
#include "proto/import/obj.h"
#include "proto/import/ply.h"
#include "proto/import/read_file.h"

namespace tessera::proto {
namespace {

/// Indices are 32 bits wide: a file up to this size can't hold more vertices or corners than that.
constexpr std::uintmax_t kLargestFile = 4ULL << 30;

Imported read(const std::filesystem::path& path, FileFormat format, std::string_view name,
              const CompanionSource& companions) {
  std::string bytes = read_file(path, name, kLargestFile);
  switch (format) {
    case FileFormat::nff:
      return import_nff(bytes, name);
    case FileFormat::ply:
      return import_ply(bytes, name);
    case FileFormat::obj:
      return import_obj(std::move(bytes), name, companions);
  }
  std::abort();
}

}  // namespace

Result<Imported> import_file(const std::filesystem::path& path, FileFormat format, std::string_view display_name,
                             const CompanionSource& companions) {
  try {
    return read(path, format, display_name, companions);
  } catch (BrokenFile& broken) {
    return Problem{ProblemCode::invalid_document, std::string(display_name) + " can't be imported.",
                   std::move(broken.errors)};
  } catch (const std::bad_alloc&) {
    return Problem{
        ProblemCode::out_of_memory_budget, "There is no memory left to import " + std::string(display_name), {}};
  } catch (const std::exception& error) {
    return Problem{ProblemCode::invalid_document,
                   std::string(display_name) + " can't be imported.",
                   {{file_place(display_name, 0), error.what()}}};
  }
}

std::optional<FileFormat> format_of(std::string_view file_name) {
  std::string ending(file_name.substr(std::min(file_name.rfind('.'), file_name.size())));
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".obj") return FileFormat::obj;
  if (ending == ".ply") return FileFormat::ply;
  if (ending == ".nff") return FileFormat::nff;
  return std::nullopt;
}

}  // namespace tessera::proto
