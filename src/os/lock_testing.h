#pragma once

#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>

/// Helpers for tests of locks.
namespace upswing {

/// Replaces flock and fcntl's locks in this process by an answer: `error_number`, as on a file
/// system without locks, or with 0 success, as on one that grants every lock. Returns false if the
/// system cannot.
inline bool FakeLocks(int error_number) {
  const auto answer = static_cast<uint32_t>(SECCOMP_RET_ERRNO | error_number);
  constexpr uint32_t kCall = offsetof(seccomp_data, nr), kCommand = offsetof(seccomp_data, args[1]);
  std::array<sock_filter, 7> program{{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kCall),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_flock, 3, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_fcntl, 0, 3),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kCommand),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, F_OFD_SETLK, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, answer),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  }};
  const sock_fprog filter{program.size(), program.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

/// Exit code of a child process.
inline int ExitCodeOf(pid_t child) {
  int status = 0;
  return waitpid(child, &status, 0) == child && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Starts `call` in a child process with the locks of FakeLocks. The child's exit code is its
/// result; 77 if there can be no such process.
inline pid_t StartWithFakeLocks(int error_number, const std::function<int()>& call) {
  const pid_t child = fork();
  if (child == 0) _exit(FakeLocks(error_number) ? call() : 77);
  return child;
}

}  // namespace upswing
