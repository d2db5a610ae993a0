#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <unistd.h>

#include "proto/wire/sha256.h"
#include "server/log.h"
#include "tests/support/fuzz_fail.h"
#include "tests/support/fuzz_main.h"
#include "tests/support/logged_tiles.h"

namespace {

namespace fs = std::filesystem;
using namespace tessera;
using namespace tessera::server;

const fs::path& folder() {
  static const fs::path path = fs::temp_directory_path() / ("tessera-tiles-" + std::to_string(::getpid()));
  return path;
}

struct LogRecord {
  std::uint32_t index;
  std::string payload;
};
/// By passes.
using LogFiles = std::map<unsigned, std::vector<LogRecord>>;

/// The records of an image that is in its third pass.
const LogFiles& logged_files() {
  static const LogFiles files = [] {
    fs::remove_all(folder());
    Logged logged(folder());
    for (int pass = 0; pass < 3; ++pass) {
      logged.begin();
      logged.store(0);
      if (pass < 2) logged.store(1);
      if (pass < 2) logged.passes.next(0);
    }
    LogFiles read;
    for (const auto& entry : fs::directory_iterator(folder())) {
      std::ifstream stream(entry.path(), std::ios::binary);
      const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
      for (std::size_t at = 0; at < bytes.size();) {
        std::uint32_t head[2];
        std::memcpy(head, bytes.data() + at, sizeof head);
        read[std::stoul(entry.path().stem())].push_back({head[0], bytes.substr(at + sizeof head, head[1])});
        at += sizeof head + head[1] + 71;
      }
    }
    return read;
  }();
  return files;
}

void write_files(const LogFiles& files, std::size_t cut_off) {
  fs::remove_all(folder());
  fs::create_directories(folder());
  for (const auto& [pass, records] : files) {
    std::string bytes;
    for (const auto& [index, payload] : records) {
      const std::uint32_t head[2] = {index, static_cast<std::uint32_t>(payload.size())};
      std::string record(reinterpret_cast<const char*>(head), sizeof head);
      record += payload;
      bytes += record + proto::content_hash(record);
    }
    bytes.resize(bytes.size() - std::min(cut_off, bytes.size()));
    std::ofstream(folder() / (std::to_string(pass) + ".tiles"), std::ios::binary) << bytes;
  }
}

}  // namespace

/// A line a change of a whole log, whose hashes fit again afterwards: a character for what is changed, one each for the
/// file and the record, and what it takes.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Log quiet({"off", LogFormat::text, false});
  std::string_view input(reinterpret_cast<const char*>(data), size);
  LogFiles files = logged_files();
  std::size_t cut_off = 0;
  while (!input.empty()) {
    const std::string_view line = input.substr(0, input.find('\n'));
    input.remove_prefix(std::min(line.size() + 1, input.size()));
    if (line.size() < 3) continue;
    std::vector<LogRecord>& records = files[static_cast<unsigned>(line[1] & 7)];
    const std::size_t at = records.empty() ? 0 : static_cast<unsigned char>(line[2]) % records.size();
    const std::string_view rest = line.substr(3);
    if (line[0] == 'c') cut_off += static_cast<unsigned char>(line[2]);
    if (line[0] == '+') records.push_back({static_cast<std::uint32_t>(line[2] & 3), std::string(rest)});
    if (records.empty()) continue;
    LogRecord& record = records[at];
    if (line[0] == '-') records.erase(records.begin() + static_cast<std::ptrdiff_t>(at));
    if (line[0] == '=') record.payload = rest;
    if (line[0] == '2') files[static_cast<unsigned>(rest.empty() ? 0 : rest[0] & 7)].push_back(LogRecord(record));
    if (line[0] == '#' && !rest.empty()) record.index = static_cast<std::uint32_t>(rest[0]) - '0';
    if (line[0] == '.' && !rest.empty() && !record.payload.empty())
      record.payload[static_cast<unsigned char>(rest[0]) % record.payload.size()] = rest.back();
  }
  write_files(files, cut_off);
  const auto load = [] { return TileLog(folder(), logged_settings(), kTiles).load(); };
  const auto stored = load();
  if (!stored) {
    expect(files.empty() || !fs::exists(folder()) || fs::is_empty(folder()), "what can't be used is left");
    return 0;
  }
  expect(stored->tiles.size() == kTiles.size() && stored->is_done.size() == kTiles.size(), "another number of tiles");
  for (std::size_t i = 0; i < kTiles.size(); ++i) {
    expect(stored->tiles[i] || stored->pass == 0, "a tile is missing after the first pass");
    expect(!stored->is_done[i] || stored->tiles[i], "a tile is done that isn't there");
  }
  const auto again = load();
  expect(again && again->pass == stored->pass && again->is_done == stored->is_done, "it is another the second time");
  return 0;
}
