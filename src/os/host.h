#pragma once

#include <cstdint>
#include <string>

namespace upswing {

/// Network name of this machine.
std::string HostName();

/// Number of this process.
int64_t ProcessId();

/// Identifies this machine until its next boot: host name and boot ID.
std::string HostAndBoot();

/// Model of the processor, such as "AMD EPYC 9454P"; "unknown" if the system does not tell.
std::string CpuModel();

/// Number of processors that this process may use, from its affinity and its container's limit. At
/// least 1.
int UsableProcessors();

/// Number of threads: `wanted`, or if that is 0 UsableProcessors, at most 8.
int ResolveThreads(int64_t wanted);

/// Bytes of memory that this process can still get: the machine's free memory within the limits of
/// the process and of its control group. The largest number if the system does not tell.
int64_t AvailableMemory();

}  // namespace upswing
