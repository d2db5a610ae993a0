#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

namespace tessera::proto {

/// What a file is by its content. Its name says nothing here.
enum class FileKind {
  unknown,
  // What scenes are made of.
  json,
  obj,
  mtl,
  ply,
  nff,
  // What others make models and scenes of.
  gltf,
  glb,
  stl_ascii,
  stl_binary,
  fbx,
  blend,
  three_ds,
  alembic,
  usd,
  vrml,
  off,
  vtk,
  collada,
  xml,
  html,
  // Images, archives and others that get mixed up with scenes.
  png,
  jpeg,
  gif,
  tiff,
  webp,
  exr,
  hdr,
  pdf,
  zip,
  gzip,
  bzip2,
  xz,
  zstandard,
  seven_zip,
  tar,
  program,
};

/// "a glTF file", as it stands in a sentence; "a file of no kind that is known here" for unknown.
std::string_view description(FileKind kind);

/// As many bytes of a file as `file_kind` looks at.
inline constexpr std::size_t kFileHead = 1 << 16;

/// The kind of a file of `size` bytes that begins with `head`, the whole of it or at least `kFileHead` bytes. Binary
/// STL, which has no signature, is told by its size; text formats by the first statement that only one of them has.
/// `unknown` for empty files, and for text that no statement tells, comments alone say. Text in UTF-16 is unknown, too.
FileKind file_kind(std::string_view head, std::uintmax_t size);

/// The kind of the file at `path`; `unknown` when it can't be read.
FileKind file_kind(const std::filesystem::path& path);

}  // namespace tessera::proto
