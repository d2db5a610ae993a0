#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sqlite3.h>
#include <unistd.h>

#include "server/jobs/job_submission.h"
#include "server/jobs/job_table.h"
#include "server/log.h"
#include "server/store/blob_store.h"
#include "server/store/image_store.h"
#include "server/store/journal.h"
#include "server/store/journal_check.h"
#include "server/store/scene_store.h"
#include "tests/support/fuzz_fail.h"
#include "tests/support/fuzz_main.h"
#include "tests/support/no_files.h"

namespace {

namespace fs = std::filesystem;
using namespace tessera;
using namespace tessera::server;

const fs::path& folder() {
  static const fs::path path = [] {
    const fs::path made = fs::temp_directory_path() / ("tessera-journal-" + std::to_string(::getpid()));
    fs::remove_all(made);
    for (const char* name : {"images", "blobs", "scenes", "aside"}) fs::create_directories(made / name);
    return made;
  }();
  return path;
}
fs::path journal_path() { return folder() / "journal.db"; }
fs::path log_path() { return folder() / "journal.db-wal"; }

std::string read_whole(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

JobOrder small_order(std::uint32_t width) {
  JobOrder order{};
  order.document = R"({"scene":"sha256:)" + std::string(64, 'a') + R"(","image":{"width":)" + std::to_string(width) +
                   R"(,"height":9}})";
  order.settings = Settings();
  order.settings.width = width;
  order.settings.height = 9;
  order.scene_hash = "sha256:" + std::string(64, 'a');
  return order;
}

struct Bytes {
  std::string file, log;
};

/// A journal of some jobs in all states, half of it in its log, as a killed daemon leaves it.
const Bytes& whole_journal() {
  static const Bytes bytes = [] {
    const fs::path made = folder() / "made.db";
    Bytes copied;
    for (int round = 0; round < 2; ++round) {
      Journal journal(made);
      JobTable table({1000, 1000, 1 << 30}, &journal);
      for (std::uint32_t i = 1; i < 12; ++i) {
        const auto job = table.add(small_order(i));
        job->written.get();
        if (i % 4 > 0) table.start_preparing(job->id);
        if (i % 4 > 1) table.start_rendering(job->id, std::nullopt, nullptr);
        if (i % 4 > 2)
          table.complete(job->id, std::nullopt, {.for_journal = std::make_shared<const std::string>(5000, 'x')});
        if (i == 6) table.cancel(job->id);
        if (i == 7) table.fail(job->id, "for some reason");
      }
      const auto last = table.add(small_order(50));
      last->written.get();
      if (round == 1) copied = {read_whole(made), read_whole(made.string() + "-wal")};
    }
    return copied;
  }();
  return bytes;
}

void overwrite(std::string& bytes, std::size_t at, std::string_view with) {
  if (bytes.empty()) return;
  at %= bytes.size();
  with = with.substr(0, bytes.size() - at);
  bytes.replace(at, with.size(), with);
}

/// Adds rows as a daemon might have written them, whatever they say.
void add_rows(std::string_view lines) {
  sqlite3* database = nullptr;
  expect(::sqlite3_open(journal_path().c_str(), &database) == SQLITE_OK, "the journal can't be opened");
  sqlite3_stmt* insert = nullptr;
  ::sqlite3_prepare_v2(database, "INSERT INTO events(seq, job, kind, time, body) VALUES(?, ?, ?, ?, ?)", -1, &insert,
                       nullptr);
  ::sqlite3_exec(database, "BEGIN", nullptr, nullptr, nullptr);
  while (!lines.empty()) {
    std::string_view line = lines.substr(0, lines.find('\n'));
    lines.remove_prefix(std::min(line.size() + 1, lines.size()));
    for (int place = 1; place <= 5; ++place) {
      const std::string_view field = place == 5 ? line : line.substr(0, line.find(' '));
      line.remove_prefix(std::min(field.size() + 1, line.size()));
      if (place == 1 && field.empty())
        ::sqlite3_bind_null(insert, place);
      else
        ::sqlite3_bind_text(insert, place, field.data(), static_cast<int>(field.size()), SQLITE_STATIC);
    }
    ::sqlite3_step(insert);
    ::sqlite3_reset(insert);
  }
  ::sqlite3_exec(database, "COMMIT", nullptr, nullptr, nullptr);
  ::sqlite3_finalize(insert);
  ::sqlite3_close(database);
}

/// The jobs that a daemon finds; nothing where it doesn't start, and says why.
std::optional<std::vector<std::string>> start_daemon() {
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  static const BlobStore blobs(folder() / "blobs", folder() / "aside", std::nullopt, proto::direct_reader());
  static SceneStore scenes(folder() / "scenes", folder() / "aside", blobs, {}, 1 << 20);
  try {
    Journal journal(journal_path());
    ImageStore films(folder() / "images", folder() / "aside", journal);
    JobTable table({1000, 1000, 1 << 30}, &journal);
    restore_jobs(journal, films, scenes, table);
    std::vector<std::string> jobs;
    for (const JobView& job : table.list("", kAll, std::nullopt)) {
      jobs.push_back(job.id);
      status_of(job, JobTimes::Clock::now());
      films.load(job.id);
      if (job.order->retry) table.claim(*job.order->retry);
    }
    return jobs;
  } catch (const std::runtime_error& refused) {
    expect(std::string_view(refused.what()).starts_with(folder().c_str()), "it isn't said of which file");
    return std::nullopt;
  }
}

std::string line_of(const JournalEntry& entry) {
  return std::to_string(entry.seq) + ' ' + entry.job + ' ' + entry.kind + ' ' + entry.body;
}

const std::set<std::string>& entries_of_whole_journal() {
  static const std::set<std::string> lines = [] {
    std::set<std::string> read;
    const fs::path whole = folder() / "whole.db";
    std::ofstream(whole, std::ios::binary) << whole_journal().file;
    std::ofstream(whole.string() + "-wal", std::ios::binary) << whole_journal().log;
    for (const JournalEntry& entry : Journal(whole).since(0, 1000)) read.insert(line_of(entry));
    return read;
  }();
  return lines;
}

/// Of a journal that is refused another one can be made, with which a daemon starts; of one that was changed, all that
/// is in it was in the whole one.
void check_salvage(bool was_whole) {
  check_journal(journal_path(), Journal::Missing::is_lost, folder() / "aside");
  if (was_whole) {
    const Journal journal(journal_path());
    for (const JournalEntry& entry : journal.since(0, 1000))
      expect(entries_of_whole_journal().contains(line_of(entry)), "an entry is salvaged that never was: " + entry.body);
  }
  expect(start_daemon().has_value(), "no daemon starts with a salvaged journal");
}

/// The entries that don't lie on this page, which is to be read as the file format has it, not as it is salvaged: job
/// and kind follow each other in an entry's record.
std::set<std::string> entries_beside(std::string_view page) {
  std::set<std::string> beside;
  const fs::path whole = folder() / "whole.db";
  for (const JournalEntry& entry : Journal(whole).since(0, 1000))
    if (page.find(entry.job + entry.kind) == page.npos) beside.insert(line_of(entry));
  return beside;
}

/// The journal with all that was in its log, and then one page overwritten: nothing is lost but what lay there. Of the
/// root of the tree of entries, which is the second page, nothing is asked.
void check_page(std::size_t number, char with) {
  static const std::string whole = [] {
    entries_of_whole_journal();  // Makes the file, and closing it brings the log into it.
    return read_whole(folder() / "whole.db");
  }();
  constexpr std::size_t kPage = 4096;
  const std::size_t begin = number % (whole.size() / kPage) * kPage;
  if (begin == kPage) return;
  const std::set<std::string> least = entries_beside(std::string_view(whole).substr(begin, kPage));
  std::string bytes = whole;
  overwrite(bytes, begin, std::string(kPage, with));
  std::ofstream(journal_path(), std::ios::binary) << bytes;
  check_journal(journal_path(), Journal::Missing::is_lost, folder() / "aside");
  std::set<std::string> kept;
  for (const JournalEntry& entry : Journal(journal_path()).since(0, 1000)) kept.insert(line_of(entry));
  expect(std::ranges::includes(kept, least), "entries of whole pages are lost");
}

}  // namespace

/// The first character says what the rest is: 'F' the journal's file; 'M' changes of a whole journal, two bytes each
/// for where and how much, of its log where the amount is odd, and a byte; 'T' where its file, and then its log, is cut
/// off; 'P' a page of the whole journal, without a log, and a byte to overwrite it with; 'R' rows, a line each: number,
/// job, kind, time and body.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Log quiet({"off", LogFormat::text, false});
  if (size == 0) return 0;
  const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  Bytes bytes = whole_journal();
  if (data[0] == 'F') bytes = {std::string(rest), ""};
  if (data[0] == 'M')
    for (std::size_t at = 0; at + 5 <= rest.size(); at += 5) {
      const auto byte = [&](std::size_t i) {
        return static_cast<std::size_t>(static_cast<unsigned char>(rest[at + i]));
      };
      const std::size_t amount = byte(2) + 256 * byte(3);
      std::string& changed = amount % 2 == 0 ? bytes.file : bytes.log;
      overwrite(changed, (byte(0) + 256 * byte(1)) * (amount % 4 < 2 ? 1 : 7), std::string(amount / 4, rest[at + 4]));
    }
  if (data[0] == 'T' && rest.size() >= 4) {
    const auto cut = [&](std::string& text, std::size_t i) {
      const std::size_t left = static_cast<unsigned char>(rest[i]) + 256U * static_cast<unsigned char>(rest[i + 1]);
      text.resize(std::min(text.size(), left));
    };
    cut(bytes.file, 0);
    cut(bytes.log, 2);
  }
  for (const char* left : {"", "-wal", "-shm", "-journal"}) fs::remove(journal_path().string() + left);
  if (data[0] == 'P' && rest.size() >= 2) check_page(static_cast<unsigned char>(rest[0]), rest[1]);
  if (data[0] == 'P') return fs::remove_all(folder() / "aside"), 0;
  std::ofstream(journal_path(), std::ios::binary) << bytes.file;
  if (!bytes.log.empty()) std::ofstream(log_path(), std::ios::binary) << bytes.log;
  if (data[0] == 'R') add_rows(rest);

  const auto jobs = start_daemon();
  if (jobs) expect(start_daemon() == jobs, "the next daemon finds other jobs");
  if (data[0] == 'M' && size == 1) expect(jobs.has_value(), "a whole journal is refused");
  if (!jobs) check_salvage(data[0] == 'M' || data[0] == 'T');
  fs::remove_all(folder() / "aside");
  return 0;
}
