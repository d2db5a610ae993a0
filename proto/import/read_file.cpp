#include "proto/import/read_file.h"

#include <fstream>
#include <utility>

#include "proto/import/broken_file.h"

namespace tessera::proto {

std::string read_file(const std::filesystem::path& path, std::string_view name, std::uintmax_t limit) {
  const auto fail = [&](std::string detail) { throw BrokenFile{{{file_place(name, 0), std::move(detail)}}}; };
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) fail("The file can't be opened");
  if (size > limit) fail("The file is larger than " + std::to_string(limit >> 20) + " MiB");
  // Read, not mapped: a mapped file that somebody truncates would raise SIGBUS.
  std::string bytes(size, '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.read(bytes.data(), static_cast<std::streamsize>(size))) fail("The file can't be read to its end");
  return bytes;
}

}  // namespace tessera::proto
