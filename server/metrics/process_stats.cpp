#include "server/metrics/process_stats.h"

#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>

#include <sys/resource.h>
#include <unistd.h>

namespace tessera::server {
namespace {

double seconds_of(clockid_t clock) {
  timespec time{};
  ::clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

}  // namespace

ProcessStats process_stats() {
  ProcessStats stats;
  std::ifstream file("/proc/self/stat");
  const std::string line{std::istreambuf_iterator<char>(file), {}};
  const std::size_t name_end = line.rfind(')');  // The name may hold anything.
  if (name_end != std::string::npos) {
    const auto ticks = static_cast<double>(::sysconf(_SC_CLK_TCK));
    std::istringstream fields(line.substr(name_end + 1));
    std::string ignored;
    const auto skip = [&](int count) {
      while (count-- > 0) fields >> ignored;
    };
    double user = 0, system = 0, started = 0;
    std::uint64_t pages = 0;
    skip(11);  // Up to cmajflt, which is field 13.
    fields >> user >> system;
    skip(4);
    fields >> stats.threads;
    skip(1);
    fields >> started >> stats.virtual_bytes >> pages;
    stats.cpu_seconds = (user + system) / ticks;
    static const double booted = seconds_of(CLOCK_REALTIME) - seconds_of(CLOCK_BOOTTIME);
    stats.start_time = booted + started / ticks;
    stats.resident_bytes = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  }
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) == 0) stats.most_files = files.rlim_cur;
  std::error_code error;
  for (std::filesystem::directory_iterator at("/proc/self/fd", error), end; !error && at != end; at.increment(error))
    ++stats.open_files;
  if (stats.open_files > 0) --stats.open_files;  // The one that lists them.
  return stats;
}

}  // namespace tessera::server
