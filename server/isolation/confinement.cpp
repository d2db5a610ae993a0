#include "server/isolation/confinement.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <fstream>
#include <vector>

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/sched.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace tessera::server {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kHasShadowMemory = true;  // Of terabytes of addresses.
#else
constexpr bool kHasShadowMemory = false;
#endif

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kArchitecture = 0;  // Of which nothing is known here: there is no filter.
#endif

/// Memory, threads, what is open, the time, and the end.
constexpr std::uint32_t kAllowed[] = {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    __NR_pipe2,  // By which sanitizers find out whether memory may be read.
#if defined(__NR_pipe)
    __NR_pipe,
#endif
#endif
    __NR_read,
    __NR_write,
    __NR_readv,
    __NR_writev,
    __NR_pread64,
    __NR_pwrite64,
    __NR_lseek,
    __NR_fstat,
    __NR_ftruncate,
    __NR_fallocate,
    __NR_close,
    __NR_recvmsg,
    __NR_sendmsg,
    __NR_ppoll,
    __NR_mmap,
    __NR_munmap,
    __NR_mprotect,
    __NR_mremap,
    __NR_madvise,
    __NR_brk,
    __NR_futex,
    __NR_exit,
    __NR_exit_group,
    __NR_rt_sigaction,
    __NR_rt_sigprocmask,
    __NR_rt_sigreturn,
    __NR_sigaltstack,
    __NR_getpid,
    __NR_getppid,
    __NR_gettid,
    __NR_clock_gettime,
    __NR_clock_getres,
    __NR_clock_nanosleep,
    __NR_nanosleep,
    __NR_gettimeofday,
    __NR_sched_yield,
    __NR_sched_getaffinity,
    __NR_getrandom,
    __NR_set_robust_list,
    __NR_set_tid_address,
    __NR_restart_syscall,
    __NR_getrusage,
    __NR_uname,
    __NR_sysinfo,
    __NR_membarrier,
#ifdef __NR_rseq
    __NR_rseq,
#endif
#ifdef __NR_poll
    __NR_poll,
#endif
#ifdef __NR_time
    __NR_time,
#endif
};

sock_filter load(std::size_t offset) { return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset)); }
sock_filter give(std::uint32_t what) { return BPF_STMT(BPF_RET | BPF_K, what); }

/// The low half of an argument: both architectures are little-endian.
std::size_t argument(std::size_t i) { return offsetof(seccomp_data, args) + 8 * i; }

/// What isn't allowed fails with EPERM: a library that asks for more than it needs goes on without.
std::vector<sock_filter> filter() {
  constexpr std::uint32_t kRefuse = SECCOMP_RET_ERRNO | EPERM;
  std::vector<sock_filter> program{
      load(offsetof(seccomp_data, arch)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kArchitecture, 1, 0),
      give(SECCOMP_RET_KILL_PROCESS),
      load(offsetof(seccomp_data, nr)),
  };
  for (const std::uint32_t call : kAllowed) {
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 1));
    program.push_back(give(SECCOMP_RET_ALLOW));
  }
  // `call` is allowed where its argument has all of `bits`, which are all that count.
  const auto allow_with = [&](std::uint32_t call, std::size_t i, std::uint32_t mask, std::uint32_t bits) {
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 5));
    program.push_back(load(argument(i)));
    program.push_back(BPF_STMT(BPF_ALU | BPF_AND | BPF_K, mask));
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, bits, 0, 1));
    program.push_back(give(SECCOMP_RET_ALLOW));
    program.push_back(give(kRefuse));
  };
  allow_with(__NR_clone, 0, CLONE_THREAD, CLONE_THREAD);
  allow_with(__NR_tgkill, 0, UINT32_MAX, static_cast<std::uint32_t>(::getpid()));  // abort(3)
  allow_with(__NR_prlimit64, 0, UINT32_MAX, 0);  // Its own limits, which it can but lower.
  allow_with(__NR_prctl, 0, UINT32_MAX, PR_SET_NAME);
  allow_with(__NR_newfstatat, 3, AT_EMPTY_PATH, AT_EMPTY_PATH);  // fstat(3)
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, __NR_clone3, 0, 1));
  program.push_back(give(SECCOMP_RET_ERRNO | ENOSYS));  // Then clone(2) is tried, whose flags can be looked at.
  program.push_back(give(kRefuse));
  return program;
}

/// Lowers a limit. Whether it was higher.
template <typename Resource>
bool limit(Resource resource, rlim_t most, rlim_t grace = 0) {
  rlimit now{};
  if (::getrlimit(resource, &now) != 0 || now.rlim_cur <= most) return false;
  const rlimit lower{most, std::min(most + grace, now.rlim_max)};
  return ::setrlimit(resource, &lower) == 0;
}

std::uint64_t address_space() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// By this process when it was confined: later it can't look. 0 where that isn't known.
std::uint64_t addresses_taken = 0;

constexpr rlim_t kMostOpenFiles = 8192;  // The files that others refer to are open, too.

}  // namespace

void confine() {
  addresses_taken = kHasShadowMemory ? 0 : address_space();
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_NOFILE, kMostOpenFiles);
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  if (kArchitecture == 0) return;
  auto program = filter();
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter);
}

bool limit_to(const Allowance& allowance) {
  limit(RLIMIT_CPU, allowance.seconds, 1);  // SIGXCPU, which tells why, comes before SIGKILL.
  limit(RLIMIT_FSIZE, allowance.written_bytes);
  return addresses_taken > 0 && limit(RLIMIT_AS, addresses_taken + allowance.memory);
}

bool can_filter_system_calls() {
  // A filter that isn't there is a bad address where there are filters.
  return kArchitecture != 0 && ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, nullptr) != 0 && errno == EFAULT;
}

}  // namespace tessera::server
