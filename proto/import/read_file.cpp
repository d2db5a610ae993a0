#include "proto/import/read_file.h"

#include <algorithm>
#include <fstream>
#include <utility>

#include "proto/import/broken_file.h"
#include "proto/wire/abandoned.h"

namespace tessera::proto {
namespace {

constexpr std::uintmax_t kChunk = 1 << 20;

}  // namespace

std::string read_file(const InputFile& input, std::string_view name, std::uintmax_t limit,
                      const std::stop_token& stop) {
  const auto fail = [&](std::string detail) { throw BrokenFile{{{file_place(name, 0), std::move(detail)}}}; };
  std::error_code error;
  const std::uintmax_t size = input.content ? input.content->size() : std::filesystem::file_size(input.path, error);
  if (error) fail("The file can't be opened");
  if (size > limit) fail("The file is larger than " + std::to_string(limit >> 20) + " MiB");
  if (input.content) return std::string(*input.content);
  // Read, not mapped: a mapped file that somebody truncates would raise SIGBUS.
  std::string bytes;
  bytes.reserve(size);
  std::ifstream file(input.path, std::ios::binary);
  while (bytes.size() < size) {
    throw_if_abandoned(stop);
    const std::size_t begin = bytes.size();
    bytes.resize(std::min<std::uintmax_t>(size, begin + kChunk));
    if (!file.read(bytes.data() + begin, static_cast<std::streamsize>(bytes.size() - begin)))
      fail("The file can't be read to its end");
  }
  return bytes;
}

FileKind kind_of(const InputFile& file) {
  if (!file.content) return file_kind(file.path);
  return file_kind(file.content->substr(0, kFileHead), file.content->size());
}

}  // namespace tessera::proto
