#include "server/store/write_ahead_log.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <vector>

namespace tessera::server {
namespace {

constexpr std::size_t kLogHeader = 32, kFrameHeader = 24, kFrame = kFrameHeader + kJournalPage;
/// The last bit says in which order the bytes of words are for checksums.
constexpr std::uint32_t kLogMagic = 0x377f0682;

std::uint32_t word_at(std::string_view bytes, std::size_t at, bool most_significant_first = true) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto byte = static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i]));
    word |= byte << 8 * (most_significant_first ? 3 - i : i);
  }
  return word;
}

struct LogChecksum {
  std::uint32_t first = 0, second = 0;

  bool operator==(const LogChecksum&) const = default;
};

LogChecksum stored_checksum(std::string_view bytes, std::size_t at) {
  return {word_at(bytes, at), word_at(bytes, at + 4)};
}

void add_to_checksum(LogChecksum& sum, std::string_view bytes, bool most_significant_first) {
  for (std::size_t at = 0; at + 8 <= bytes.size(); at += 8) {
    sum.first += word_at(bytes, at, most_significant_first) + sum.second;
    sum.second += word_at(bytes, at + 4, most_significant_first) + sum.first;
  }
}

class LogReader {
 public:
  explicit LogReader(std::string_view log) : log_(log) {
    if (log_.size() < kLogHeader + kFrame) return;
    frames_ = (log_.size() - kLogHeader) / kFrame;
    const bool is_known = (word_at(log_, 0) & ~1U) == kLogMagic;
    is_big_ = is_known && (word_at(log_, 0) & 1U) != 0;
    LogChecksum sum;
    add_to_checksum(sum, log_.substr(0, 24), is_big_);
    has_header_ = is_known && word_at(log_, 8) == kJournalPage && sum == stored_checksum(log_, 24);
    salts_ = has_header_ ? log_.substr(16, 8) : salts_of(0);
    if (!has_header_ && frames_ > 1 && salts_.find_first_not_of('\0') == salts_.npos) salts_ = salts_of(1);
    for (std::size_t i = 0; i < frames_; ++i) is_whole_.push_back(is_whole(i));
  }

  WriteAheadLog read() const {
    WriteAheadLog read;
    std::size_t good = 0;
    while (has_header_ && good < frames_ && is_whole_[good]) ++good;
    // How many transactions follow each other behind the first frame that isn't whole.
    std::size_t most = 0, in_a_row = 0;
    for (std::size_t i = good + 1; i < frames_; ++i) {
      if (!is_whole_[i])
        in_a_row = 0;
      else if (is_commit(i))
        most = std::max(most, ++in_a_row);
    }
    if (most >= 2)
      read.damage = "its log is damaged at byte " + std::to_string(has_header_ ? kLogHeader + good * kFrame : 0) +
                    ", and there is more behind that";
    std::size_t used = 0;
    for (std::size_t i = 0; i < (read.damage.empty() ? good : frames_); ++i)
      if (is_whole_[i] && is_commit(i)) used = i + 1;
    for (std::size_t i = 0; i < used; ++i)
      if (salts_of(i) == salts_)
        read.pages.push_back({word_at(frame(i), 0),
                              std::span<const char, kJournalPage>(frame(i).data() + kFrameHeader, kJournalPage),
                              is_whole_[i]});
    return read;
  }

 private:
  std::string_view frame(std::size_t i) const { return log_.substr(kLogHeader + i * kFrame, kFrame); }
  /// What tells the frames from those of earlier rounds, over which the log is written.
  std::string_view salts_of(std::size_t i) const { return frame(i).substr(8, 8); }
  bool is_commit(std::size_t i) const { return word_at(frame(i), 4) != 0; }
  /// Whether its checksum goes on where that ended which the one before says.
  bool is_whole(std::size_t i) const {
    LogChecksum sum = i == 0 ? stored_checksum(log_, 24) : stored_checksum(frame(i - 1), 16);
    add_to_checksum(sum, frame(i).substr(0, 8), is_big_);
    add_to_checksum(sum, frame(i).substr(kFrameHeader), is_big_);
    return salts_of(i) == salts_ && sum == stored_checksum(frame(i), 16);
  }

  std::string_view log_;
  std::size_t frames_ = 0;
  bool has_header_ = false, is_big_ = false;
  std::string_view salts_;
  std::vector<bool> is_whole_;  ///< By frames.
};

}  // namespace

WriteAheadLog read_write_ahead_log(const std::string& log) { return LogReader(log).read(); }

}  // namespace tessera::server
