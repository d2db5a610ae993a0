#include "tests/benchmarks/support/daemon_process.h"

#include <csignal>
#include <cstdio>
#include <ctime>
#include <stdexcept>
#include <string>

#include <sys/wait.h>
#include <unistd.h>

namespace tessera::bench {

DaemonProcess::DaemonProcess(const std::filesystem::path& program, const std::vector<std::string>& flags) {
  std::string folder = std::filesystem::temp_directory_path() / "tessera-bench-XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no temporary folder for the daemon");
  data_ = folder;
  std::vector<std::string> command = {program.string(), "--port", "0", "--data-dir", folder, "--log-level", "warn"};
  command.insert(command.end(), flags.begin(), flags.end());
  std::vector<char*> arguments;
  for (std::string& word : command) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  int output[2];
  if (pipe(output) != 0) throw std::runtime_error("no pipe for the daemon");
  process_ = fork();
  if (process_ == 0) {
    dup2(output[1], STDOUT_FILENO);
    close(output[0]);
    close(output[1]);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  close(output[1]);
  // "listening on http://127.0.0.1:<port>"; the end of the file instead when it couldn't start.
  std::string line;
  FILE* from = fdopen(output[0], "r");
  for (int c; (c = std::fgetc(from)) != EOF && c != '\n';) line += static_cast<char>(c);
  std::fclose(from);
  const auto address = client::parse_server_url(line.substr(line.rfind(' ') + 1));
  if (!address) throw std::runtime_error("tesserad didn't start: " + line);
  address_ = *address;
}

DaemonProcess::~DaemonProcess() {
  kill(process_, SIGTERM);
  waitpid(process_, nullptr, 0);
  std::error_code ignored;
  std::filesystem::remove_all(data_, ignored);
}

double DaemonProcess::cpu_seconds() const {
  clockid_t clock;
  timespec spent;
  if (clock_getcpuclockid(process_, &clock) != 0 || clock_gettime(clock, &spent) != 0)
    throw std::runtime_error("the daemon has ended");
  return static_cast<double>(spent.tv_sec) + 1e-9 * static_cast<double>(spent.tv_nsec);
}

}  // namespace tessera::bench
