#include <algorithm>
#include <cerrno>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>

#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "client/doctor.h"
#include "proto/wire/given_memory.h"

namespace tessera::client {
namespace {

namespace fs = std::filesystem;
using Verdict = Finding::Verdict;

constexpr double kLeastFree = 256 << 20, kLittleFree = 4.0 * (1 << 30);

std::string why(int error) { return std::generic_category().message(error); }

Finding folder_finding(const fs::path& folder) {
  struct stat about {};
  if (::stat(folder.c_str(), &about) != 0)
    return {Verdict::fail, "data folder", folder.string() + ": " + why(errno), "name the folder that tesserad has"};
  if (!S_ISDIR(about.st_mode))
    return {Verdict::fail, "data folder", folder.string() + " is no folder", "name the folder that tesserad has"};
  for (const char* part : {"blobs", "scenes"}) {
    struct stat about_part {};
    if (::stat((folder / part).c_str(), &about_part) != 0)
      return {Verdict::fail, "data folder", (folder / part).string() + ": " + why(errno),
              "restore it, or start tesserad with this --data-dir to have it made"};
    if (about_part.st_uid != about.st_uid)
      return {Verdict::fail, "data folder", (folder / part).string() + " is another user's than the folder",
              "chown -R to the user that tesserad runs as"};
  }
  if (about.st_mode & (S_IWGRP | S_IWOTH))
    return {Verdict::warn, "data folder", folder.string() + " can be written to by others",
            "chmod go-w " + folder.string()};
  return {Verdict::ok, "data folder", folder.string() + " is its owner's alone to write to"};
}

Finding disk_finding(const fs::path& folder) {
  struct statvfs disk {};
  if (::statvfs(folder.c_str(), &disk) != 0) return {Verdict::fail, "disk space", why(errno), "see to the disk"};
  const double free = static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize);
  const std::string detail = in_units(free) + " free";
  const bool has_files_left = disk.f_files == 0 || disk.f_favail > 1000;
  if (!has_files_left) return {Verdict::fail, "disk space", "hardly an inode is free", "remove files on that disk"};
  if (free < kLeastFree) return {Verdict::fail, "disk space", detail, "free space, or move --data-dir to another disk"};
  if (free < kLittleFree)
    return {Verdict::warn, "disk space", detail, "free space, or move --data-dir to another disk"};
  return {Verdict::ok, "disk space", detail};
}

/// The process that holds the folder's lock (proc(5), locks).
std::optional<std::string> holder_of(const fs::path& lock) {
  struct stat about {};
  if (::stat(lock.c_str(), &about) != 0) return std::nullopt;
  const std::string inode = ':' + std::to_string(about.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, advisory, access, process, file;
    words >> number >> kind >> advisory >> access >> process >> file;
    if (kind == "FLOCK" && file.ends_with(inode) && !process.starts_with('-')) return process;
  }
  return std::nullopt;
}

Finding memory_finding(const std::string& process, const std::map<std::string, double>& metrics) {
  const auto limit = metrics.find("tessera_memory_limit_bytes");
  const double wanted = limit == metrics.end() ? 0 : limit->second;
  const proto::GivenMemory memory = proto::given_memory(process);
  const auto given = static_cast<double>(memory.bytes);
  const std::string whose = memory.by_cgroup ? "its cgroup gives" : "the machine has";
  if (wanted == 0)
    return {Verdict::warn, "memory limit", whose + ' ' + in_units(given) + "; the server doesn't say what it may take",
            "ask with an admin's key"};
  const std::string detail = "the server may take " + in_units(wanted) + "; " + whose + ' ' + in_units(given);
  if (wanted <= 0.8 * given) return {Verdict::ok, "memory limit", detail};
  return {Verdict::warn, "memory limit", detail, "lower --memory, or give it more"};
}

}  // namespace

std::vector<Finding> examine_machine(const fs::path& data_dir, const std::map<std::string, double>& metrics) {
  std::vector<Finding> findings{folder_finding(data_dir)};
  if (findings.front().verdict == Verdict::fail) return findings;
  findings.push_back(disk_finding(data_dir));
  const auto process = holder_of(data_dir / "lock");
  if (!process) {
    findings.push_back({Verdict::warn, "process", "no tesserad that can be seen from here holds the folder's lock",
                        "start it, or look on the machine, or in the container, where it runs"});
    return findings;
  }
  findings.push_back({Verdict::ok, "process", "process " + *process + " holds the folder's lock"});
  findings.push_back(memory_finding(*process, metrics));
  return findings;
}

}  // namespace tessera::client
