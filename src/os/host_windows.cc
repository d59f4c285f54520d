#include <array>
#include <bit>
#include <limits>
#include <thread>

#include "base/text.h"
#include "os/host.h"
#include "os/win32.h"

namespace upswing {

int UsableProcessors() {
  DWORD_PTR usable = 0, present = 0;
  // The masks are 0 if this process runs in several groups of 64 processors.
  const bool known = GetProcessAffinityMask(GetCurrentProcess(), &usable, &present) != 0;
  if (known && usable != 0) return std::popcount(usable);
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

std::string HostName() {
  std::array<wchar_t, 256> name{};
  auto size = static_cast<DWORD>(name.size());
  GetComputerNameExW(ComputerNameDnsHostname, name.data(), &size);
  return Printable(win32::Narrow(name.data()));
}

int64_t ProcessId() { return GetCurrentProcessId(); }

std::string HostAndBoot() {
  // The locks end with their processes, so the name identifies a boot well enough.
  static const std::string kHost = HostName();
  return kHost;
}

std::string CpuModel() {
  std::array<wchar_t, 256> name{};
  DWORD size = sizeof name - sizeof(wchar_t);
  const LSTATUS failed =
      RegGetValueW(HKEY_LOCAL_MACHINE, L"HARDWARE\\DESCRIPTION\\System\\CentralProcessor\\0",
                   L"ProcessorNameString", RRF_RT_REG_SZ, nullptr, name.data(), &size);
  return failed == ERROR_SUCCESS ? std::string(Trim(win32::Narrow(name.data()))) : "unknown";
}

int64_t AvailableMemory() {
  MEMORYSTATUSEX memory{};
  memory.dwLength = sizeof memory;
  if (GlobalMemoryStatusEx(&memory) == 0) return std::numeric_limits<int64_t>::max();
  return static_cast<int64_t>(memory.ullAvailPageFile);
}

}  // namespace upswing
