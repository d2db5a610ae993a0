#include "proto/wire/key_file.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string_view>

#include <unistd.h>

#include "tests/support/fuzz_fail.h"
#include "tests/support/fuzz_main.h"

namespace fs = std::filesystem;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  static const fs::path folder = fs::temp_directory_path() / ("tessera-keys-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(proto::key_file(folder), std::ios::binary)
      << std::string_view(reinterpret_cast<const char*>(data), size);
  try {
    for (const proto::Key& key : proto::read_keys(folder)) {
      expect(proto::is_owner_name(key.owner) && !key.id.empty(), "a key of nobody");
      expect(!proto::fits(key.token_hash, ""), "a key that everybody has");
      expect(!key.limits.requests_per_second || *key.limits.requests_per_second > 0, "a key without any request");
    }
  } catch (const std::runtime_error& refused) {
    expect(std::string_view(refused.what()).starts_with(folder.c_str()), "it isn't said of which file");
  }
  fs::remove_all(folder);
  return 0;
}
