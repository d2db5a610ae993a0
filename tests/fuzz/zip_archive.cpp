#include "server/handlers/zip_archive.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "tests/support/fuzz_fail.h"
#include "tests/support/fuzz_main.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  using namespace tessera::server;
  constexpr std::uint64_t kMostBytes = 1 << 20;
  const std::string_view archive(reinterpret_cast<const char*>(data), size);
  const auto files = unpack_zip(
      archive, kMostBytes, [] { return std::make_shared<ReceivedFile>(std::filesystem::temp_directory_path()); },
      std::stop_token());
  if (!files) {
    const auto code = files.problem().code;
    expect(code == proto::ProblemCode::payload_too_large || code == proto::ProblemCode::malformed_request,
           "an archive is refused with " + std::string(proto::entry(code).name));
    to_json(files.problem()).dump();  // It is UTF-8.
    return 0;
  }
  expect(files->size() <= kMostFiles, "too many files");
  std::set<std::string> names;
  std::uint64_t bytes = 0;
  for (const NamedFile& file : *files) {
    expect(why_unsafe(file.name).empty(), "a name that leads elsewhere: " + file.name);
    expect(names.insert(file.name).second, "two files of one name: " + file.name);
    file.file->finish();
    expect(file.file->content().size() == file.file->size(), "a file of another size than it says");
    bytes += file.file->size();
  }
  expect(bytes <= kMostBytes, "too many bytes");
  return 0;
}
