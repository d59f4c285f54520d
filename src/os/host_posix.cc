#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <optional>
#include <thread>

#include "base/error.h"
#include "base/text.h"
#include "os/file.h"
#include "os/host.h"

namespace upswing {
namespace {

/// Reads the text after `key` and a colon, from the first such line of a system file.
std::optional<std::string> ReadEntry(const char* path, std::string_view key) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    const size_t colon = line.find(':');
    if (!line.starts_with(key) || colon == std::string::npos) continue;
    return std::string(Trim(std::string_view(line).substr(colon + 1)));
  }
  return std::nullopt;
}

/// The bytes of an entry such as `1024 kB`.
std::optional<int64_t> ReadBytes(const char* path, std::string_view key) {
  constexpr int64_t kKilobyte = 1024;
  const auto entry = ReadEntry(path, key);
  const auto number = entry ? ParseInteger(Split(*entry, ' ').front()) : std::nullopt;
  return number ? std::optional(kKilobyte * *number) : std::nullopt;
}

std::optional<int64_t> ReadInteger(const char* path) {
  std::ifstream file(path);
  std::string line;
  return std::getline(file, line) ? ParseInteger(line) : std::nullopt;
}

/// Processors, out of `present`, that a container's CPU quota allows (Linux, control groups 2:
/// "QUOTA PERIOD" in microseconds, or "max PERIOD").
int WithinQuota(int present) {
  std::ifstream file("/sys/fs/cgroup/cpu.max");
  double quota = 0;
  double period = 0;
  if (!(file >> quota >> period) || !(period > 0)) return present;
  return static_cast<int>(std::clamp(quota / period, 1.0, static_cast<double>(present)));
}

}  // namespace

int UsableProcessors() {
  cpu_set_t usable;
  // The call fails on systems with more processors than fit in a cpu_set_t.
  const bool known = sched_getaffinity(0, sizeof(usable), &usable) == 0;
  const int present =
      known ? CPU_COUNT(&usable) : static_cast<int>(std::thread::hardware_concurrency());
  return WithinQuota(std::max(1, present));
}

std::string HostName() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return Printable(name.data());
}

int64_t ProcessId() { return getpid(); }

std::string HostAndBoot() {
  static const std::string kHost = [] {
    std::string boot;
    try {
      boot = ReadOwnFile("/proc/sys/kernel/random/boot_id");
    } catch (const Error&) {  // NOLINT(bugprone-empty-catch): then the name has to do
    }
    return Concat(HostName(), "/", Trim(boot).substr(0, 8));
  }();
  return kHost;
}

std::string CpuModel() { return ReadEntry("/proc/cpuinfo", "model name").value_or("unknown"); }

int64_t AvailableMemory() {
  int64_t bytes = std::numeric_limits<int64_t>::max();
  const auto limit_to = [&](std::optional<int64_t> limit) {
    if (limit) bytes = std::min(bytes, std::max<int64_t>(0, *limit));
  };
  if (const auto free = ReadBytes("/proc/meminfo", "MemAvailable")) {
    limit_to(*free + ReadBytes("/proc/meminfo", "SwapFree").value_or(0));
  }
  // Limit of a control group, version 2. Do not subtract its usage, which includes the file cache
  // that the system can free.
  limit_to(ReadInteger("/sys/fs/cgroup/memory.max"));
  rlimit address_space{};
  if (getrlimit(RLIMIT_AS, &address_space) == 0 && address_space.rlim_cur != RLIM_INFINITY) {
    limit_to(static_cast<int64_t>(address_space.rlim_cur) -
             ReadBytes("/proc/self/status", "VmSize").value_or(0));
  }
  return bytes;
}

}  // namespace upswing
