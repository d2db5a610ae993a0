#include "server/store/journal.h"

#include <algorithm>
#include <filesystem>
#include <future>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

using proto::ProblemCode;
using Outcome = std::optional<proto::Problem>;

Journal::Append entry(const std::string& job, const std::string& kind) {
  Journal::Append append;
  append.job = job;
  append.kind = kind;
  append.time = std::chrono::system_clock::time_point(std::chrono::milliseconds(1234567890123));
  append.body = [] { return R"({"a":1})"; };
  append.is_awaited = true;
  return append;
}

/// Appends, and waits for what becomes of it.
Outcome append(Journal& journal, Journal::Append entry) {
  std::promise<Outcome> promise;
  entry.done = [&promise, told = false](const Outcome& outcome, std::uint64_t) mutable {
    if (!std::exchange(told, true)) promise.set_value(outcome);
  };
  journal.append(std::move(entry));
  return promise.get_future().get();
}

void run(const std::filesystem::path& file, const char* sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(::sqlite3_open(file.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(::sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << ::sqlite3_errmsg(database);
  ::sqlite3_close(database);
}

TEST(Journal, HasWhatWasAppendedAfterItWasOpenedAgain) {
  const TemporaryFolder folder;
  {
    Journal journal(folder.path() / "journal.db");
    EXPECT_FALSE(append(journal, entry("a", "queued")));
    EXPECT_FALSE(append(journal, entry("b", "queued")));
    EXPECT_FALSE(append(journal, entry("a", "completed")));
    EXPECT_FALSE(journal.trouble());
  }
  Journal journal(folder.path() / "journal.db");
  const auto entries = journal.since(0, 10);
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_LT(entries[0].seq, entries[1].seq);
  EXPECT_LT(entries[1].seq, entries[2].seq);
  EXPECT_EQ(entries[2].job, "a");
  EXPECT_EQ(entries[2].kind, "completed");
  EXPECT_EQ(entries[2].time, entry("", "").time);
  EXPECT_EQ(entries[2].body, R"({"a":1})");
  EXPECT_EQ(journal.since(entries[0].seq, 1).at(0).seq, entries[1].seq);
  EXPECT_GT(journal.append(entry("c", "queued")), entries[2].seq);
}

TEST(Journal, WritesAtTheEndWhatNobodyWaitsFor) {
  const TemporaryFolder folder;
  {
    Journal journal(folder.path() / "journal.db");
    Journal::Append later = entry("a", "preparing");
    later.is_awaited = false;
    journal.append(std::move(later));
  }
  EXPECT_EQ(Journal(folder.path() / "journal.db").since(0, 10).size(), 1U);
}

TEST(Journal, ManyAtOnceAreTakenInTheirOrder) {
  const TemporaryFolder folder;
  Journal journal(folder.path() / "journal.db");
  std::vector<std::uint64_t> appended, told;
  for (int i = 0; i < 200; ++i) {
    Journal::Append next = entry(std::to_string(i), "queued");
    next.done = [&told, i](const Outcome& outcome, std::uint64_t) {
      if (!outcome) told.push_back(static_cast<std::uint64_t>(i));
    };
    appended.push_back(journal.append(std::move(next)));
  }
  journal.close();
  ASSERT_EQ(told.size(), 200U);
  EXPECT_TRUE(std::ranges::is_sorted(told));
  const auto entries = journal.since(0, 1000);
  ASSERT_EQ(entries.size(), 200U);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    EXPECT_EQ(entries[i].seq, appended[i]);
    EXPECT_EQ(entries[i].job, std::to_string(i));
  }
}

TEST(Journal, OfARemovedJobOneEntryStays) {
  const TemporaryFolder folder;
  Journal journal(folder.path() / "journal.db");
  EXPECT_FALSE(append(journal, entry("a", "queued")));
  EXPECT_FALSE(append(journal, entry("b", "queued")));
  Journal::Append removed = entry("a", "removed");
  removed.removes_others = true;
  EXPECT_FALSE(append(journal, std::move(removed)));
  const auto entries = journal.since(0, 10);
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].job, "b");
  EXPECT_EQ(entries[1].kind, "removed");
}

TEST(Journal, WhatCannotBeWrittenIsRefusedOrTriedAgain) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "journal.db", aside = folder.path() / "aside.db";
  Journal journal(file);
  std::filesystem::rename(file, aside);  // What goes into a file that has gone would be lost.
  Journal::Append end = entry("a", "completed");
  std::promise<void> written;
  end.done = [&](const Outcome& outcome, std::uint64_t) {
    if (!outcome) written.set_value();
  };
  journal.append(std::move(end));
  Journal::Append refused = entry("b", "queued");
  refused.on_failure = Journal::OnFailure::refuse;
  const Outcome outcome = append(journal, std::move(refused));
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->code, ProblemCode::storage_unavailable);
  EXPECT_TRUE(journal.trouble());
  std::filesystem::rename(aside, file);
  written.get_future().get();
  const auto entries = journal.since(0, 10);
  ASSERT_EQ(entries.size(), 1U) << "the other one was refused";
  EXPECT_EQ(entries[0].job, "a");
  EXPECT_FALSE(append(journal, entry("c", "queued")));
  EXPECT_FALSE(journal.trouble());
}

TEST(Journal, KnowsWhatItCannotUse) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "journal.db";
  { Journal journal(file); }
  run(file, "PRAGMA user_version = 1000");
  EXPECT_THROW(Journal journal(file), std::runtime_error) << "of a newer program";
  const auto broken = folder.write("broken.db", std::string(8192, 'x'));
  EXPECT_THROW(Journal journal(broken), std::runtime_error);
}

TEST(Journal, IsOneOfSqlitesWithAVersion) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "journal.db";
  { Journal journal(file); }
  sqlite3* database = nullptr;
  ASSERT_EQ(::sqlite3_open(file.c_str(), &database), SQLITE_OK);
  const auto number = [&](const char* sql) {
    sqlite3_stmt* statement = nullptr;
    ::sqlite3_prepare_v2(database, sql, -1, &statement, nullptr);
    ::sqlite3_step(statement);
    const int value = ::sqlite3_column_int(statement, 0);
    ::sqlite3_finalize(statement);
    return value;
  };
  EXPECT_GE(number("PRAGMA user_version"), 1);
  EXPECT_EQ(number("SELECT count(*) FROM events"), 0);
  ::sqlite3_close(database);
}

}  // namespace
}  // namespace tessera::server
