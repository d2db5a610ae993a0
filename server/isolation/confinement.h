#pragma once

#include <cstdint>

namespace tessera::server {

/// What a process may have that reads a file of a stranger's.
struct Allowance {
  std::uint64_t memory = 0;         ///< Bytes, beyond what it has.
  std::uint64_t written_bytes = 0;  ///< In any one file.
  std::uint32_t seconds = 0;        ///< Of processor time.
};

/// Lets this process, which has one thread, do nothing from now on but compute, and read and write what it has open: no
/// new privileges, no files opened, no processes made, and where the system filters system calls (seccomp(2)) none but
/// those that this takes.
void confine();

/// Limits a confined process. Whether the memory is limited by the allowance, rather than by what the process was
/// given.
bool limit_to(const Allowance& allowance);

/// Whether the system filters system calls.
bool can_filter_system_calls();

}  // namespace tessera::server
