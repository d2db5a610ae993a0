#include "proto/import/gltf/glb.h"

#include <cstdint>
#include <cstring>
#include <string>

#include "proto/import/broken_file.h"

namespace tessera::proto {
namespace {

constexpr std::string_view kSignature = "glTF";
constexpr std::size_t kHeader = 12, kChunkHeader = 8;
constexpr std::uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;

std::uint32_t word(std::string_view bytes, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
  return value;
}

}  // namespace

GltfParts take_apart(std::string_view bytes, std::string_view file_name) {
  if (!bytes.starts_with(kSignature)) return {bytes, std::nullopt, false};
  const auto fail = [&](std::string detail) { throw BrokenFile{{{file_place(file_name, 0), std::move(detail)}}}; };
  if (bytes.size() < kHeader) fail("The GLB ends within its header of 12 bytes");
  if (word(bytes, 4) != 2) fail("The GLB has version " + std::to_string(word(bytes, 4)) + "; only version 2 is known");
  const std::size_t length = word(bytes, 8);
  if (length > bytes.size()) {
    fail("The GLB says that it has " + std::to_string(length) + " bytes, and the file has " +
         std::to_string(bytes.size()));
  }
  if (length < kHeader) fail("The GLB says that it has " + std::to_string(length) + " bytes, fewer than its header");
  bytes = bytes.substr(0, length);  // what may follow is no part of it

  GltfParts parts{{}, {}, true};
  for (std::size_t at = kHeader, chunk = 0; at < bytes.size(); ++chunk) {
    const std::string where = "The GLB's chunk at byte " + std::to_string(at);
    if (bytes.size() - at < kChunkHeader) fail(where + " ends within its header");
    const std::size_t size = word(bytes, at);
    const std::uint32_t type = word(bytes, at + 4);
    at += kChunkHeader;
    if (size > bytes.size() - at) {
      fail(where + " says that it has " + std::to_string(size) + " bytes, and only " +
           std::to_string(bytes.size() - at) + " follow");
    }
    if (size % 4 != 0) fail(where + " has " + std::to_string(size) + " bytes, which is no multiple of 4");
    const std::string_view content = bytes.substr(at, size);
    if ((chunk == 0) != (type == kJson)) fail(where + " is out of order: the first chunk, and no other, holds JSON");
    if (type == kJson) parts.json = content;
    if (type == kBinary && chunk != 1) fail(where + " is out of order: binary data is the second chunk");
    if (type == kBinary) parts.binary = content;
    at += size;
  }
  if (parts.json.empty()) fail("The GLB holds no JSON");
  // The chunk should be filled up with blanks; some writers use zeros.
  parts.json = parts.json.substr(0, parts.json.find_last_not_of('\0') + 1);
  return parts;
}

}  // namespace tessera::proto
