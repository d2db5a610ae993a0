#include "server/isolation/zygote.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/isolation/confinement.h"

namespace tessera::server {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kHasReports = true;  // On stderr, of sanitizers.
#else
constexpr bool kHasReports = false;
#endif

void tell(int channel, WorkerSays what, int number) {
  try_to_send_message(channel, static_cast<std::uint32_t>(what),
                      {reinterpret_cast<const char*>(&number), sizeof(number)});
}

/// Signals that somebody sends to all of a daemon's processes are for the daemon: it ends the others.
void leave_signals_to_daemon() {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGPIPE}) std::signal(signal, SIG_IGN);
}

/// Closes all files but these and the three standard ones.
void close_files_but(std::vector<int> kept) {
  std::sort(kept.begin(), kept.end());
  unsigned next = 3;
  for (const int file : kept) {
    const auto number = static_cast<unsigned>(file);
    if (number > next) ::syscall(SYS_close_range, next, number - 1, 0);
    next = std::max(next, number + 1);
  }
  ::syscall(SYS_close_range, next, ~0U, 0);
}

/// The standard files are the daemon's, and its log is no place for what strangers make a library say.
void say_nothing() {
  const FileDescriptor nowhere(::open("/dev/null", O_RDWR | O_CLOEXEC));
  if (!nowhere) return;
  for (const int file : {0, 1, kHasReports ? 1 : 2}) ::dup2(nowhere.value(), file);
}

/// When memory runs out, the system had better end this one than the daemon.
void offer_to_out_of_memory_killer() { std::ofstream("/proc/self/oom_score_adj") << 1000; }

/// What is thrown ends it: above it on the stack is what the daemon does.
[[noreturn]] void be_worker(FileDescriptor channel, const Work& work, bool is_prepared,
                            const std::string& why_not_prepared) noexcept {
  ::prctl(PR_SET_NAME, "tessera-spare");
  offer_to_out_of_memory_killer();
  close_files_but({channel.value()});
  for (const int signal : {SIGXFSZ, SIGXCPU}) std::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  confine();
  Worker worker(channel.value(), is_prepared, why_not_prepared);
  Message request = worker.hear();
  ::prctl(PR_SET_NAME, "tessera-reader");
  work(worker, std::move(request));
  ::_exit(0);
}

class Zygote {
 public:
  Zygote(FileDescriptor control, const Work& work, const std::function<void()>& prepare, bool is_prepared)
      : control_(std::move(control)), work_(work), prepare_(prepare), is_prepared_(is_prepared) {
    sigset_t child;
    sigemptyset(&child);
    sigaddset(&child, SIGCHLD);
    ::sigprocmask(SIG_SETMASK, &child, nullptr);
    ended_ = FileDescriptor(::signalfd(-1, &child, SFD_CLOEXEC | SFD_NONBLOCK));
    if (is_prepared_) prepare_now();
  }

  [[noreturn]] void run() noexcept {
    for (;;) {
      std::vector<pollfd> looked_at{{control_.value(), POLLIN, 0}, {ended_.value(), POLLIN, 0}};
      for (const auto& [process, channel] : channels_)
        if (channel) looked_at.push_back({channel.value(), 0, 0});
      if (::poll(looked_at.data(), looked_at.size(), -1) < 0) continue;
      // First, as from then on these numbers may be other files'.
      for (std::size_t i = 2; i < looked_at.size(); ++i)
        if ((looked_at[i].revents & (POLLHUP | POLLERR)) != 0) end_worker_of(looked_at[i].fd);
      if (looked_at[1].revents != 0) say_who_ended();
      if (looked_at[0].revents != 0) {
        std::optional<Message> told = receive_message(control_.value());
        if (!told) ::_exit(0);  // Workers end as this does.
        if (told->files.size() == 1) make(static_cast<ZygoteHears>(told->kind), std::move(told->files.front()));
      }
    }
  }

 private:
  void prepare_now() {
    try {
      prepare_();
      why_not_prepared_.clear();
    } catch (const std::exception& error) {
      why_not_prepared_ = error.what();
    }
  }

  void make(ZygoteHears what, FileDescriptor channel) {
    const pid_t parent = ::getpid();
    const pid_t process = ::fork();
    if (process < 0) {
      if (what == ZygoteHears::make_worker) tell(channel.value(), WorkerSays::none, errno);
      return;
    }
    if (process == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (::getppid() != parent) ::_exit(0);
      channels_.clear();
      if (what == ZygoteHears::make_worker) {
        if (is_prepared_) prepare_now();  // What it touches is then this process's own before a request comes.
        be_worker(std::move(channel), work_, is_prepared_, why_not_prepared_);
      }
      close_files_but({channel.value()});
      Zygote(std::move(channel), work_, prepare_, true).run();
    }
    // A zygote's end tells of itself: it is the only one who has it.
    channels_[process] = what == ZygoteHears::make_worker ? std::move(channel) : FileDescriptor();
  }

  void say_who_ended() {
    signalfd_siginfo signal{};
    while (::read(ended_.value(), &signal, sizeof(signal)) > 0) {
    }
    int status = 0;
    for (pid_t process = 0; (process = ::waitpid(-1, &status, WNOHANG)) > 0;) {
      const auto found = channels_.find(process);
      if (found == channels_.end()) continue;
      if (found->second) tell(found->second.value(), WorkerSays::ended, status);
      channels_.erase(found);
    }
  }

  void end_worker_of(int channel) {
    for (auto& [process, other_end] : channels_) {
      if (other_end.value() != channel) continue;
      ::kill(process, SIGKILL);
      other_end = FileDescriptor();
      return;
    }
  }

  FileDescriptor control_, ended_;
  const Work& work_;
  const std::function<void()>& prepare_;
  const bool is_prepared_;
  std::string why_not_prepared_;
  std::map<pid_t, FileDescriptor> channels_;  ///< Of those that haven't ended; none once somebody closed its other end.
};

}  // namespace

ZygoteProcess start_zygote(const Work& work, const std::function<void()>& prepare) {
  auto [ours, its] = make_channel();
  const pid_t daemon = ::getpid();
  const pid_t process = ::fork();
  if (process < 0) throw std::system_error(errno, std::generic_category(), "cannot make a process");
  if (process > 0) return {std::move(ours), process};
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != daemon) ::_exit(0);
  ::prctl(PR_SET_NAME, "tessera-zygote");
  leave_signals_to_daemon();
  say_nothing();
  close_files_but({its.value()});
  Zygote(std::move(its), work, prepare, false).run();
}

}  // namespace tessera::server
