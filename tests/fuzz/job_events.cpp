#include <charconv>
#include <cstddef>
#include <exception>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "server/jobs/job_table.h"
#include "tests/support/fuzz_fail.h"
#include "tests/support/fuzz_main.h"

namespace {

using namespace tessera;
using namespace tessera::server;

std::string_view take_until(std::string_view& text, char end) {
  const std::size_t at = std::min(text.find(end), text.size());
  const std::string_view taken = text.substr(0, at);
  text.remove_prefix(std::min(at + 1, text.size()));
  return taken;
}

/// An event of the journal that could be read is the same when it is written and read once more.
void check_event(const JournalEntry& entry, const JobEvent& event) {
  const std::string body = body_of(event);
  try {
    const JobEvent again = read_event({entry.seq, entry.job, std::string(kind_of(event)), event.time, body});
    expect(again.what.index() == event.what.index() && body_of(again) == body, "an event is another: " + body);
  } catch (const std::exception& error) {
    fail("an event can't be read again: " + body + ": " + error.what());
  }
}

void check_table(JobTable& table) {
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  const auto jobs = table.list("", kAll, std::nullopt);
  const JobTable::Usage usage = table.usage();
  std::size_t counted = 0, unfinished = 0;
  for (const std::uint32_t count : usage.by_state) counted += count;
  for (const JobView& job : jobs) {
    const auto found = table.find(job.id);
    expect(found && found->state == job.state, "a job that is listed isn't there");
    status_of(job, JobTimes::Clock::now());
    if (!proto::has_ended(job.state)) ++unfinished;
    if (job.order->retry) table.claim(*job.order->retry);
  }
  expect(counted == jobs.size() && unfinished == usage.unfinished, "jobs are counted wrongly");
}

}  // namespace

/// A line an event, as the journal has it: the job's id, the kind, the milliseconds since 1970, and the body.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view input(reinterpret_cast<const char*>(data), size);
  JobTable table({1000, 1000, 1 << 30});
  for (std::uint64_t seq = 1; !input.empty(); ++seq) {
    std::string_view line = take_until(input, '\n');
    JournalEntry entry{seq, std::string(take_until(line, ' ')), std::string(take_until(line, ' ')), {}, {}};
    const std::string_view time = take_until(line, ' ');
    std::int64_t milliseconds = 0;
    std::from_chars(time.data(), time.data() + time.size(), milliseconds);
    entry.time = journal_time(milliseconds);
    entry.body = line;
    std::optional<JobEvent> event;
    try {
      event = read_event(entry);
    } catch (const std::exception&) {  // It is left out.
      continue;
    }
    check_event(entry, *event);
    try {
      table.restore(entry.job, *event, seq);
    } catch (const std::exception&) {  // So is one that can't follow those before.
    }
  }
  check_table(table);
  return 0;
}
