#include "server/store/tile_log.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <fstream>
#include <limits>
#include <set>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "proto/wire/sha256.h"
#include "server/jobs/job_event.h"
#include "server/store/stored_json.h"

namespace tessera::server {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr std::uint32_t kTileLogVersion = 1;
constexpr std::uint32_t kTileLogHeader = std::numeric_limits<std::uint32_t>::max();  ///< In place of a tile's index.
constexpr std::size_t kTileHashSize = 71;                                            // "sha256:" and 64 digits.

[[noreturn]] void fail_with(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

void append_bytes(std::string& to, const void* bytes, std::size_t size) {
  to.append(static_cast<const char*>(bytes), size);
}

/// Calls `use` with all vectors of a tile, in the order in which they are written.
template <typename PixelsOrConst, typename Use>
void for_pixel_planes(PixelsOrConst& pixels, const Use& use) {
  use(pixels.color);
  for (const Aov aov : pixels.aovs())
    std::visit([&]<typename T>(const std::vector<T>&) { use(pixels.template plane<T>(aov)); }, pixels.values(aov));
}
template <typename SumsOrConst, typename Use>
void for_sum_planes(SumsOrConst& sums, const Use& use) {
  for_pixel_planes(sums.totals, use);
  use(sums.second);
  for (auto& half : sums.clear) use(half);
  use(sums.mean);
  use(sums.squares);
}

std::string tile_bytes(const Pixels& pixels, const Sums& sums, const Progress::Done& done) {
  static_assert(std::is_trivially_copyable_v<Progress::Done>);
  std::string bytes;
  append_bytes(bytes, &done, sizeof done);
  const auto add = [&](const auto& plane) { append_bytes(bytes, plane.data(), plane.size() * sizeof(plane[0])); };
  for_pixel_planes(pixels, add);
  for_sum_planes(sums, add);
  return bytes;
}

StoredTile read_tile(std::string_view bytes, PixelRect rect, const Settings& settings) {
  StoredTile tile{Pixels(rect, settings.aovs), Sums(rect, settings), {}};
  const auto take = [&](void* to, std::size_t size) {
    if (size > bytes.size()) throw std::runtime_error("a tile is of another size");
    if (size > 0) std::memcpy(to, bytes.data(), size);
    bytes.remove_prefix(size);
  };
  take(&tile.done, sizeof tile.done);
  const auto read = [&](auto& plane) { take(plane.data(), plane.size() * sizeof(plane[0])); };
  for_pixel_planes(tile.pixels, read);
  for_sum_planes(tile.sums, read);
  if (!bytes.empty()) throw std::runtime_error("a tile is of another size");
  return tile;
}

/// Blocks that have the same samples one after the other are told once.
json blocks_json(const Pass& pass) {
  json runs = json::array();
  for (std::size_t i = 0; i < pass.blocks.size();) {
    std::size_t end = i;
    while (end < pass.blocks.size() && pass.blocks[end] == pass.blocks[i]) ++end;
    runs.push_back({end - i, pass.blocks[i].first, pass.blocks[i].count});
    i = end;
  }
  return runs;
}

Pass read_pass(const json& runs, const Settings& settings) {
  Pass pass(settings.width, settings.height, {});
  std::size_t at = 0;
  for (const json& run : runs) {
    const auto count = stored_number<std::size_t>(run.at(0));
    if (count > pass.blocks.size() - at) throw std::runtime_error("a pass has more blocks than its image");
    const SampleRange samples{stored_number<std::uint32_t>(run.at(1)), stored_number<std::uint32_t>(run.at(2))};
    std::fill_n(pass.blocks.begin() + static_cast<std::ptrdiff_t>(at), count, samples);
    at += count;
  }
  if (at != pass.blocks.size()) throw std::runtime_error("a pass has fewer blocks than its image");
  return pass;
}

std::string header_of(const StoredPasses& at, std::size_t tiles) {
  return json{{"version", kTileLogVersion},
              {"pass", at.pass},
              {"tiles", tiles},
              {"seconds", at.seconds},
              {"figures", json::parse(text_of(at.figures))},
              {"blocks", blocks_json(at.current)}}
      .dump();
}

}  // namespace

/// The records of a file, up to the first that isn't whole.
class TileLog::Reader {
 public:
  explicit Reader(const fs::path& path) : file_(path, std::ios::binary) {
    if (!file_) fail_with("cannot open " + path.string());
    left_ = fs::file_size(path);
  }

  /// Whether there is one more.
  bool next() {
    std::uint32_t head[2] = {};
    if (left_ < sizeof head || !file_.read(reinterpret_cast<char*>(head), sizeof head)) return false;
    if (left_ - sizeof head < std::uint64_t{head[1]} + kTileHashSize) return false;
    payload_.resize(head[1]);
    std::string hash(kTileHashSize, '\0');
    if (!file_.read(payload_.data(), head[1]) || !file_.read(hash.data(), kTileHashSize)) return false;
    proto::Sha256 sha256;
    sha256.update(std::as_bytes(std::span(head)));
    sha256.update(payload_);
    if (sha256.finish() != hash) return false;
    index_ = head[0];
    const std::uint64_t size = sizeof head + payload_.size() + kTileHashSize;
    left_ -= size;
    end_ += size;
    return true;
  }

  std::uint32_t index() const { return index_; }
  const std::string& payload() const { return payload_; }
  /// Where the record ends.
  std::uint64_t end() const { return end_; }

 private:
  std::ifstream file_;
  std::uint64_t left_ = 0, end_ = 0;
  std::uint32_t index_ = 0;
  std::string payload_;
};

TileLog::TileLog(fs::path folder, const Settings& settings, std::vector<PixelRect> tiles)
    : folder_(std::move(folder)), settings_(settings), tiles_(std::move(tiles)), written_in_(tiles_.size()) {}

std::optional<StoredPasses> TileLog::load() try {
  std::set<std::uint32_t> passes;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) passes.insert(std::stoul(entry.path().stem()));
  if (passes.empty()) return std::nullopt;
  // The tiles of all files, the later ones over the earlier; it goes on at the last pass whose header is there.
  std::vector<std::unique_ptr<StoredTile>> tiles(tiles_.size());
  std::optional<StoredPasses> found;
  std::uint64_t found_size = 0;
  std::uint32_t last_used = 0;
  for (const std::uint32_t pass : passes) {
    const bool is_whole = std::ranges::none_of(tiles, [](const auto& tile) { return !tile; });
    Reader reader(path_of(pass));
    if (!reader.next() || reader.index() != kTileLogHeader) break;
    const json header = parse_stored(reader.payload());
    if (header.at("version") != kTileLogVersion || header.at("tiles") != tiles_.size())
      throw std::runtime_error("they are another program's");
    std::uint64_t size = reader.end();
    std::vector<bool> is_done(tiles_.size());
    while (reader.next()) {
      const std::size_t index = reader.index();
      if (index >= tiles_.size()) throw std::runtime_error("there is no such tile");
      tiles[index] = std::make_unique<StoredTile>(read_tile(reader.payload(), tiles_[index], settings_));
      written_in_[index] = pass;
      is_done[index] = true;
      size = reader.end();
      last_used = pass;
    }
    if (!header.contains("pass") || !(is_whole || pass == 0)) continue;
    found.emplace(StoredPasses{pass,
                               header.at("seconds"),
                               read_figures(header.at("figures").dump()),
                               read_pass(header.at("blocks"), settings_),
                               {},
                               std::move(is_done)});
    found_size = size;
  }
  if (!found || last_used > found->pass) throw std::runtime_error("a pass is incomplete");
  for (const std::uint32_t pass : passes)
    if (pass > found->pass) fs::remove(path_of(pass));  // It had just begun.
  found->tiles = std::move(tiles);
  pass_ = found->pass;
  file_ = FileDescriptor(::open(path_of(pass_).c_str(), O_WRONLY | O_CLOEXEC));
  const auto end = static_cast<off_t>(found_size);  // After it there may be a part of a record.
  if (!file_ || ::ftruncate(file_.value(), end) != 0 || ::lseek(file_.value(), end, SEEK_SET) != end)
    fail_with("cannot open " + path_of(pass_).string());
  return found;
} catch (const std::exception& problem) {
  spdlog::warn("tiles in {} can't be used, and are rendered again: {}", folder_.string(), problem.what());
  std::ranges::fill(written_in_, std::nullopt);
  file_ = FileDescriptor();
  remove(folder_);
  return std::nullopt;
}

void TileLog::begin(const StoredPasses& at, const Passes& passes, const Film& film) {
  if (given_up_) return;
  try {
    if (at.pass == 0) {
      first_header_ = header_of(at, tiles_.size());
      return;
    }
    first_header_.clear();
    if (std::ranges::any_of(written_in_, [](const auto& file) { return !file; })) {
      // It wasn't worth it so far.
      open(at.pass - 1, json{{"version", kTileLogVersion}, {"tiles", tiles_.size()}}.dump());
      for (std::size_t i = 0; i < tiles_.size(); ++i) {
        Pixels pixels(tiles_[i], settings_.aovs);
        pixels.copy(film.pixels(), tiles_[i]);
        write_tile(i, pixels, passes.sums(tiles_[i]), {});
      }
    }
    if (::fdatasync(file_.value()) != 0) fail_with("cannot sync " + path_of(pass_).string());
    const std::set<std::optional<std::uint32_t>> needed(written_in_.begin(), written_in_.end());
    for (std::uint32_t pass = 0; pass < at.pass; ++pass)
      if (!needed.contains(pass)) fs::remove(path_of(pass));
    open(at.pass, header_of(at, tiles_.size()));
  } catch (const std::exception& error) {
    give_up(error.what());
  }
}

void TileLog::skip() {
  const bool has_files = std::ranges::any_of(written_in_, [](const auto& file) { return file.has_value(); });
  first_header_.clear();
  file_ = FileDescriptor();
  std::ranges::fill(written_in_, std::nullopt);
  if (has_files) remove(folder_);
}

void TileLog::open(std::uint32_t pass, const std::string& header) {
  fs::create_directories(folder_);
  file_ = FileDescriptor(::open(path_of(pass).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  if (!file_) fail_with("cannot make " + path_of(pass).string());
  pass_ = pass;
  write(kTileLogHeader, header);
}

void TileLog::add(std::size_t index, const Pixels& pixels, const Sums& sums, const Progress::Done& done) {
  const std::lock_guard lock(mutex_);
  if (given_up_) return;
  try {
    if (!first_header_.empty()) open(0, std::exchange(first_header_, ""));
    if (file_) write_tile(index, pixels, sums, done);
  } catch (const std::exception& error) {
    give_up(error.what());
  }
}

void TileLog::write_tile(std::size_t index, const Pixels& pixels, const Sums& sums, const Progress::Done& done) {
  write(static_cast<std::uint32_t>(index), tile_bytes(pixels, sums, done));
  written_in_[index] = pass_;
}

void TileLog::write(std::uint32_t index, const std::string& payload) {
  const std::uint32_t head[2] = {index, static_cast<std::uint32_t>(payload.size())};
  proto::Sha256 sha256;
  sha256.update(std::as_bytes(std::span(head)));
  sha256.update(payload);
  std::string record;
  record.reserve(sizeof head + payload.size() + kTileHashSize);
  append_bytes(record, head, sizeof head);
  record += payload;
  record += sha256.finish();
  for (std::string_view rest = record; !rest.empty();) {
    const ssize_t written = ::write(file_.value(), rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail_with("cannot write " + path_of(pass_).string());
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
}

void TileLog::give_up(const std::string& why) {
  given_up_ = true;
  spdlog::warn("tiles of the job in {} aren't kept: {}", folder_.string(), why);
  file_ = FileDescriptor();
  remove(folder_);
}

void TileLog::remove() {
  file_ = FileDescriptor();
  given_up_ = true;
  remove(folder_);
}

void TileLog::remove(const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
}

}  // namespace tessera::server
