#include "server/store/journal.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <utility>

#include <spdlog/spdlog.h>

#include "server/store/journal_database.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

/// How long what nobody waits for may lie, to be written with others.
constexpr std::chrono::milliseconds kAtLeisure{50};
constexpr std::chrono::milliseconds kTryToWriteAgain{200};

Problem problem_of(const JournalDatabase::Error& error) {
  if (error.kind == JournalDatabase::Error::Kind::full)
    return {ProblemCode::insufficient_storage, "There is no room on the disk to write down what is asked for.", {}};
  return {ProblemCode::storage_unavailable, "The server can't write down what is asked for; its log says why.", {}};
}

}  // namespace

std::chrono::system_clock::time_point journal_time(std::int64_t milliseconds) {
  using Time = std::chrono::system_clock::time_point;
  const auto in_milliseconds = [](Time time) {
    return std::chrono::floor<std::chrono::milliseconds>(time).time_since_epoch().count();
  };
  const std::int64_t first = in_milliseconds(Time::min()) + 1, last = in_milliseconds(Time::max());
  return Time(std::chrono::milliseconds(std::clamp(milliseconds, first, last)));
}

DamagedJournal::DamagedJournal(const std::filesystem::path& file, const std::string& what_is_wrong)
    : std::runtime_error(file.string() + " is damaged: " + what_is_wrong +
                         ". Nothing of it has been changed. Put a copy of yours in its place, and remove " +
                         file.filename().string() +
                         "-wal and -shm; or let tesserad --scrub, with the same "
                         "--data-dir, set it aside and make a new one of all that can still be read."),
      why(what_is_wrong) {}

Journal::Journal(const std::filesystem::path& file, Missing missing)
    : writing_(open_journal(file, missing)),
      reading_(std::make_unique<JournalDatabase>(file, JournalDatabase::Open::read)),
      file_(file),
      last_seq_(static_cast<std::uint64_t>(writing_->number("SELECT coalesce(max(seq), 0) FROM events"))),
      writer_([this] { write_on(); }) {}

Journal::~Journal() { close(); }

void Journal::close() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_one();
  if (writer_.joinable()) writer_.join();
}

std::uint64_t Journal::append(Append entry) {
  const auto due = Clock::now() + (entry.is_awaited ? Clock::duration::zero() : kAtLeisure);
  std::uint64_t seq = 0;
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({last_seq_ + 1, std::move(entry)});
    seq = ++last_seq_;
    due_ = std::min(due_.value_or(due), due);
  }
  changed_.notify_one();
  return seq;
}

void Journal::remove_image(const std::string& job) {
  Append entry{job, "image_gone", std::chrono::system_clock::now(), nullptr};
  entry.removes_image = true;
  append(std::move(entry));
}

template <typename Read>
auto Journal::read(const Read& from) const try {
  const std::lock_guard lock(reading_mutex_);
  return from(*reading_);
} catch (const JournalDatabase::Error& error) {
  if (error.kind == JournalDatabase::Error::Kind::damage) throw DamagedJournal(file_, error.what());
  throw;
}

std::vector<JournalEntry> Journal::since(std::uint64_t seq, std::size_t limit) const {
  return read([&](JournalDatabase& database) { return database.since(seq, limit); });
}

std::optional<std::string> Journal::image(const std::string& job) const {
  return read([&](JournalDatabase& database) { return database.image(job); });
}

std::vector<std::string> Journal::images() const {
  return read([](JournalDatabase& database) { return database.images(); });
}

std::optional<Problem> Journal::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void Journal::write_on() {
  std::unique_lock lock(mutex_);
  for (bool is_last = false; !is_last;) {
    while (!closing_ && !(due_ && *due_ <= Clock::now())) {
      if (due_)
        changed_.wait_until(lock, *due_);
      else
        changed_.wait(lock);
    }
    is_last = closing_;
    std::vector<Waiting> batch = std::move(waiting_);
    waiting_.clear();
    due_.reset();
    if (batch.empty()) continue;
    lock.unlock();
    const auto problem = write(batch);
    lock.lock();
    trouble_ = problem;
    lock.unlock();
    for (const Waiting& waiting : batch)
      if (waiting.entry.done) waiting.entry.done(problem, waiting.seq);
    if (problem)
      std::erase_if(batch, [](const Waiting& waiting) { return waiting.entry.on_failure == OnFailure::refuse; });
    else
      batch.clear();
    lock.lock();
    if (batch.empty()) continue;
    waiting_.insert(waiting_.begin(), std::make_move_iterator(batch.begin()), std::make_move_iterator(batch.end()));
    const auto again = Clock::now() + kTryToWriteAgain;
    due_ = std::min(due_.value_or(again), again);
  }
}

std::optional<Problem> Journal::write(const std::vector<Waiting>& batch) try {
  try {
    writing_->check_file();
    writing_->run("BEGIN IMMEDIATE");
    for (const auto& [seq, entry] : batch) {
      if (entry.removes_others) writing_->remove(entry.job);
      if (entry.removes_others || entry.removes_image) writing_->remove_image(entry.job);
      if (entry.image) writing_->insert_image(entry.job, *entry.image);
      writing_->insert(seq, entry, entry.body ? entry.body() : "{}");
    }
    writing_->run("COMMIT");
  } catch (...) {
    writing_->try_to_run("ROLLBACK");
    throw;
  }
  if (!std::exchange(last_error_, "").empty()) spdlog::info("the journal: it can be written again");
  return std::nullopt;
} catch (const JournalDatabase::Error& error) {
  log_once(error.what());
  return problem_of(error);
} catch (const std::exception& error) {
  log_once(error.what());
  return Problem{
      ProblemCode::storage_unavailable, "The server can't write down what is asked for; its log says why.", {}};
}

/// It is tried again several times a second.
void Journal::log_once(const std::string& error) {
  if (error != last_error_) spdlog::error("the journal: {}", error);
  last_error_ = error;
}

}  // namespace tessera::server
