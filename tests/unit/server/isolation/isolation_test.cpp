#include "server/isolation/isolation.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "proto/wire/abandoned.h"
#include "server/isolation/confinement.h"
#include "server/isolation/shared_memory.h"

namespace tessera::server {
namespace {

using namespace std::chrono_literals;
using Failure = Isolation::Failure;
using Outcome = std::variant<std::string, Failure>;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kHasShadowMemory = true;
#else
constexpr bool kHasShadowMemory = false;
#endif

constexpr Allowance kAllowance{256 << 20, 1 << 20, 1};

std::string tried(const char* what, long result) {
  return result < 0 ? std::string(what) + (errno == EPERM ? "" : std::string(" ") + std::strerror(errno) + ';')
                    : std::string(what) + " succeeded;";
}

/// Everything that the filter is to keep a process from; names of what it kept it from go without a word.
std::string try_what_is_forbidden() {
  std::string told;
  const auto expect_refused = [&](const char* what, long result) {
    if (result >= 0 || errno != EPERM) told += tried(what, result);
  };
  expect_refused("open", ::open("/etc/passwd", O_RDONLY));
  expect_refused("create", ::open("/tmp/tessera-confined", O_CREAT | O_WRONLY, 0600));
  expect_refused("socket", ::socket(AF_INET, SOCK_STREAM, 0));
  expect_refused("kill", ::kill(::getppid(), 0));
  expect_refused("fork", ::fork());
  char* const arguments[] = {nullptr};
  expect_refused("exec", ::execv("/bin/true", arguments));
  expect_refused("unlink", ::unlink("/tmp/tessera-confined"));
  return told;
}

[[gnu::noinline]] void* more_memory(std::size_t bytes) { return std::malloc(bytes); }

/// What a test asks of a worker.
void do_as_told(Worker& worker, Message request) {
  const std::string& what = request.body;
  if (what == "echo") return worker.done("echo");
  if (what == "is prepared") return worker.done(worker.is_prepared() ? "yes" : "no");
  if (what == "abort") std::abort();
  if (what == "segv") std::raise(SIGSEGV);
  if (what == "kill") std::raise(SIGKILL);
  if (what == "leave") ::_exit(3);
  if (what == "throw") throw std::runtime_error("of a library");
  if (what == "hang")
    for (;;) ::pause();
  if (what == "say who and hang") {
    worker.ask(std::to_string(::getpid()));
    for (;;) ::pause();
  }
  if (what == "parent") return worker.done(std::to_string(::getppid()));
  if (what == "ask") return worker.done("heard " + worker.ask("a question").body);
  if (what == "read") {
    const Message answer = worker.ask("a file");
    const auto content = content_of(answer.files.at(0), size_of(answer.files.at(0)));
    return worker.done({reinterpret_cast<const char*>(content.data()), content.size()});
  }
  if (what == "babble")
    for (;;) worker.ask(std::string(kLongestBody, 'x'));
  limit_to(kAllowance);
  if (what == "spin")
    for (std::atomic<int> i = 0;; ++i) {
    }
  if (what == "balloon") return worker.done(more_memory(1ULL << 30) ? "has it" : "refused");
  if (what == "fill") {
    const std::vector<std::byte> much(2 << 20);
    write_all(request.files.at(0).value(), much);
  }
  if (what == "forbidden") return worker.done(try_what_is_forbidden());
  if (what == "threads") {
    std::atomic<int> sum = 0;
    {
      std::vector<std::jthread> threads;
      for (int i = 1; i <= 4; ++i) threads.emplace_back([&sum, i] { sum += i; });
    }
    return worker.done(std::to_string(sum));
  }
  if (what == "abort confined") std::abort();
}

class IsolationTest : public testing::Test {
 protected:
  Outcome run(std::string_view what, std::chrono::milliseconds patience = 20s, const std::stop_token& stop = {},
              const Isolation::AnswerTo& answer = {}) const {
    return isolation_.run({Isolation::Preparation::bare, what, {}, patience}, stop, answer);
  }

  std::string said(std::string_view what) const {
    const Outcome outcome = run(what);
    const auto* failure = std::get_if<Failure>(&outcome);
    return failure ? "failed: " + failure->how : std::get<std::string>(outcome);
  }

  std::string said_prepared(std::string_view what) const {
    const Outcome outcome = isolation_.run({Isolation::Preparation::prepared, what, {}, 20s}, {});
    return std::holds_alternative<Failure>(outcome) ? "failed" : std::get<std::string>(outcome);
  }

  std::optional<Failure::Kind> failure(std::string_view what, std::chrono::milliseconds patience = 20s) const {
    const Outcome outcome = run(what, patience);
    const auto* failure = std::get_if<Failure>(&outcome);
    return failure ? std::optional(failure->kind) : std::nullopt;
  }

  static std::ptrdiff_t open_files() { return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}); }

  static void wait_for_end(pid_t process) {
    const auto is_there = [&] {
      std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
      std::string number, name, state;
      return (stat >> number >> name >> state) && state != "Z";
    };
    while (is_there()) std::this_thread::yield();
  }

  const Isolation isolation_{do_as_told, [] {}};
};

TEST_F(IsolationTest, AWorkerSaysWhatItHasDone) {
  EXPECT_EQ(said("echo"), "echo");
  EXPECT_EQ(said("is prepared"), "no");
  EXPECT_EQ(said_prepared("is prepared"), "yes");
  EXPECT_EQ(isolation_.problem(), "");
}

TEST_F(IsolationTest, ACrashIsToldAndCostsNothingElse) {
  for (const char* how : {"abort", "segv", "leave", "throw", "abort confined"})
    EXPECT_EQ(failure(how), Failure::Kind::crashed) << how;
  EXPECT_EQ(failure("kill"), Failure::Kind::killed);
  if (!kHasShadowMemory) {
    EXPECT_NE(said("segv").find("SEGV"), std::string::npos);
  }
  EXPECT_EQ(said("echo"), "echo");
}

TEST_F(IsolationTest, AHangEndsWithPatienceAndSoDoesTheWorker) {
  pid_t worker = 0;
  const Outcome outcome = run("say who and hang", 100ms, {}, [&](std::string_view pid) {
    worker = std::stoi(std::string(pid));
    return Isolation::Answer{};
  });
  ASSERT_TRUE(std::holds_alternative<Failure>(outcome));
  EXPECT_EQ(std::get<Failure>(outcome).kind, Failure::Kind::hung);
  ASSERT_GT(worker, 0);
  wait_for_end(worker);
}

TEST_F(IsolationTest, PatienceIsForTheWorkerAlone) {
  const auto slow = [](std::string_view) {
    std::this_thread::sleep_for(300ms);  // As hashing a file takes its time: longer than the patience.
    return Isolation::Answer{"it", {}};
  };
  const Outcome outcome = run("ask", 250ms, {}, slow);
  ASSERT_TRUE(std::holds_alternative<std::string>(outcome));
  EXPECT_EQ(std::get<std::string>(outcome), "heard it");
}

TEST_F(IsolationTest, WhatIsSpentOnProcessorsIsLimited) { EXPECT_EQ(failure("spin"), Failure::Kind::hung); }

TEST_F(IsolationTest, WhoNeverStopsTalkingRunsOutOfPatience) {
  EXPECT_EQ(failure("babble", 100ms), Failure::Kind::hung);
}

TEST_F(IsolationTest, MemoryIsLimited) {
  if (kHasShadowMemory) GTEST_SKIP() << "sanitizers take terabytes of addresses";
  EXPECT_EQ(said("balloon"), "refused");
}

TEST_F(IsolationTest, WhatIsWrittenIsLimited) {
  const FileDescriptor memory = make_shared_memory();
  const std::array files{memory.value()};
  const Outcome outcome = isolation_.run({Isolation::Preparation::bare, "fill", files, 20s}, {});
  ASSERT_TRUE(std::holds_alternative<Failure>(outcome));
  EXPECT_EQ(std::get<Failure>(outcome).kind, Failure::Kind::killed);
  EXPECT_LE(size_of(memory), 1U << 20);
}

TEST_F(IsolationTest, AConfinedProcessOpensAndStartsNothing) {
  if (!can_filter_system_calls()) GTEST_SKIP() << "no seccomp here";
  EXPECT_EQ(said("forbidden"), "");
}

TEST_F(IsolationTest, AConfinedProcessHasThreads) { EXPECT_EQ(said("threads"), "10"); }

TEST_F(IsolationTest, QuestionsAreAnsweredWithFiles) {
  const FileDescriptor file = make_shared_memory(std::as_bytes(std::span(std::string_view("content"))));
  const Outcome outcome = run("read", 20s, {}, [&](std::string_view) { return Isolation::Answer{"", {file.value()}}; });
  ASSERT_TRUE(std::holds_alternative<std::string>(outcome));
  EXPECT_EQ(std::get<std::string>(outcome), "content");
}

TEST_F(IsolationTest, WhatAnAnswerThrowsIsThrown) {
  EXPECT_THROW(run("ask", 20s, {}, [](std::string_view) -> Isolation::Answer { throw std::out_of_range("it"); }),
               std::out_of_range);
}

TEST_F(IsolationTest, WhoIsStoppedIsAbandoned) {
  std::stop_source stop;
  const auto then_stop = [&](std::string_view) {
    stop.request_stop();
    return Isolation::Answer{};
  };
  EXPECT_THROW(run("say who and hang", 20s, stop.get_token(), then_stop), proto::Abandoned);
  EXPECT_THROW(run("echo", 20s, stop.get_token()), proto::Abandoned);

  std::stop_source late;
  std::jthread other([&] { late.request_stop(); });
  EXPECT_THROW(run("hang", 60s, late.get_token()), proto::Abandoned);
}

TEST_F(IsolationTest, ManyAtOnceLeaveNothingOpen) {
  EXPECT_EQ(said("echo"), "echo");  // From now on there are spare ones.
  EXPECT_EQ(said_prepared("echo"), "echo");
  const auto before = open_files();
  std::atomic<int> wrong = 0;
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 8; ++t)
      threads.emplace_back([&, t] {
        for (int i = 0; i < 25; ++i) {
          if ((t + i) % 3 == 0)
            wrong += failure("segv") != Failure::Kind::crashed;
          else
            wrong += (i % 2 == 0 ? said("echo") : said_prepared("echo")) != "echo";
        }
      });
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(open_files(), before);
}

TEST_F(IsolationTest, WhereNothingMakesProcessesThatIsSaid) {
  const pid_t zygote = std::stoi(said("parent"));
  ASSERT_EQ(::kill(zygote, SIGKILL), 0);
  wait_for_end(zygote);
  EXPECT_NE(isolation_.problem(), "");
  EXPECT_THROW(run("echo"), NoWorker);
}

TEST_F(IsolationTest, WhatMakesPreparedProcessesIsMadeAgain) {
  const pid_t zygote = std::stoi(said_prepared("parent"));
  EXPECT_NE(zygote, std::stoi(said("parent")));
  ASSERT_EQ(::kill(zygote, SIGKILL), 0);
  wait_for_end(zygote);
  EXPECT_EQ(said_prepared("echo"), "echo");
  EXPECT_EQ(isolation_.problem(), "");
}

TEST(SharedMemory, FrozenMemoryIsChangedByNobody) {
  const FileDescriptor memory = make_shared_memory(std::as_bytes(std::span(std::string_view("content"))));
  EXPECT_NE(::ftruncate(memory.value(), 3), 0) << "nobody may take it away from who has mapped it";
  {
    const auto mapped = map_to_write(memory.value(), 100);
    EXPECT_FALSE(freeze(memory));
  }
  ASSERT_TRUE(freeze(memory));
  EXPECT_NE(::pwrite(memory.value(), "x", 1, 0), 1);
  EXPECT_NE(::ftruncate(memory.value(), 1000), 0);
  EXPECT_EQ(size_of(memory), 100U);
}

TEST(SharedMemory, PartsAreMappedFromAnywhere) {
  std::vector<std::byte> bytes(300'000);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i * 31);
  const FileDescriptor memory = make_shared_memory(bytes);
  const auto part = map_part(memory.value(), 70'001, 100'000);
  EXPECT_EQ(std::memcmp(part.get(), bytes.data() + 70'001, 100'000), 0);
}

}  // namespace
}  // namespace tessera::server
