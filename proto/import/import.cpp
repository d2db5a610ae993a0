#include "proto/import/import.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "core/io/read_texture.h"
#include "proto/import/broken_file.h"
#include "proto/import/gltf/gltf.h"
#include "proto/import/nff.h"
#include "proto/import/obj.h"
#include "proto/import/ply.h"
#include "proto/import/read_file.h"
#include "proto/import/smooth_normals.h"
#include "proto/import/stl.h"
#include "proto/wire/file_kind.h"
#include "proto/wire/printable.h"

namespace tessera::proto {
namespace {

/// Indices are 32 bits wide: a file up to this size can't hold more vertices or corners than that.
constexpr std::uintmax_t kLargestFile = 4ULL << 30;

Imported read(const InputFile& file, FileFormat format, std::string_view name, const CompanionSource& companions,
              const std::stop_token& stop, const ImportOptions& options, std::uint64_t texture_bytes) {
  std::string bytes = read_file(file, name, kLargestFile, stop);
  switch (format) {
    case FileFormat::nff:
      return import_nff(bytes, name, stop);
    case FileFormat::ply:
      return import_ply(bytes, name, companions, stop, texture_bytes);
    case FileFormat::obj:
      return import_obj(std::move(bytes), name, companions, stop, texture_bytes);
    case FileFormat::gltf:
      return import_gltf(bytes, name, companions, options, texture_bytes, stop);
    case FileFormat::stl:
      return import_stl(bytes, name, stop);
  }
  std::abort();
}

/// Why a file of which nothing came is none of `format`; nothing where its content doesn't say.
std::optional<std::string> mistaken(const InputFile& file, FileFormat format) {
  const FileKind kind = kind_of(file);
  FileKind expected = FileKind::unknown;
  switch (format) {
    case FileFormat::nff:
      expected = FileKind::nff;
      break;
    case FileFormat::ply:
      expected = FileKind::ply;
      break;
    case FileFormat::obj:
      expected = FileKind::obj;
      break;
    case FileFormat::gltf:
      if (kind == FileKind::glb || kind == FileKind::json) return std::nullopt;  // JSON's own errors say more
      expected = FileKind::gltf;
      break;
    case FileFormat::stl:
      expected = kind == FileKind::stl_ascii ? FileKind::stl_ascii : FileKind::stl_binary;
      break;
  }
  if (kind == FileKind::unknown || kind == expected) return std::nullopt;
  return "This is " + std::string(description(kind)) + ", not " + std::string(description(expected));
}

/// Pointers and details quote what the files hold.
template <typename Message>
void make_sayable(std::vector<Message>& messages) {
  for (Message& message : messages) {
    message.pointer = printable(message.pointer);
    message.detail = printable(message.detail);
    if (!message.detail.ends_with('.')) message.detail += '.';
  }
}

Problem cannot_import(std::string_view name, std::vector<FieldError> errors) {
  make_sayable(errors);
  return {ProblemCode::invalid_document, std::string(name) + " can't be imported.", std::move(errors)};
}

}  // namespace

std::span<const Choice<FileFormat>> file_format_names() {
  static constexpr Choice<FileFormat> table[] = {{"obj", FileFormat::obj},
                                                 {"ply", FileFormat::ply},
                                                 {"nff", FileFormat::nff},
                                                 {"gltf", FileFormat::gltf},
                                                 {"stl", FileFormat::stl}};
  return table;
}

Result<Imported> import_file(const InputFile& file, FileFormat format, std::string_view display_name,
                             const CompanionSource& companions, std::stop_token stop, const ImportOptions& options,
                             std::uint64_t texture_bytes) {
  throw_if_abandoned(stop);
  try {
    Imported imported = read(file, format, display_name, companions, stop, options, texture_bytes);
    if (options.smooth) smooth_normals(imported, *options.smooth, stop);
    make_sayable(imported.warnings);
    if (!imported.parts.empty()) return imported;
    if (auto why = mistaken(file, format)) return cannot_import(display_name, {{file_place(display_name, 0), *why}});
    return imported;
  } catch (BrokenFile& broken) {
    if (auto why = mistaken(file, format)) broken.errors = {{file_place(display_name, 0), *std::move(why)}};
    return cannot_import(display_name, std::move(broken.errors));
  } catch (const Abandoned&) {
    throw;
  } catch (const std::bad_alloc&) {
    const std::string detail = "There is no memory left to import " + std::string(display_name) + '.';
    return Problem{ProblemCode::out_of_memory_budget, detail, {}};
  } catch (const ModuleMissing& error) {
    return Problem{ProblemCode::internal_error, error.what(), {}};
  } catch (const std::exception& error) {
    return cannot_import(display_name, {{file_place(display_name, 0), error.what()}});
  }
}

std::optional<FileFormat> format_of(std::string_view file_name) {
  std::string ending(file_name.substr(std::min(file_name.rfind('.'), file_name.size())));
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".glb") return FileFormat::gltf;
  for (const auto& [name, format] : file_format_names())
    if (ending == '.' + std::string(name)) return format;
  return std::nullopt;
}

}  // namespace tessera::proto
