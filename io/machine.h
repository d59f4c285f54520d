#pragma once

#include <cstdint>
#include <string>

namespace upswing {

/// The name of this machine in its network.
std::string HostName();

/// This machine until its next boot: its host name and the ID of its last one.
std::string ThisHost();

/// "AMD EPYC 9454P", as the system has it; "unknown" where it does not say.
std::string CpuModel();

/// Number of processors that this process may use, by its affinity and its container's limit; at
/// least 1.
int UsableProcessors();

/// `wanted`, or if that is 0 as many as UsableProcessors, but no more than 8.
int ResolveThreads(int64_t wanted);

/// Bytes of memory that this process can still ask for: what the machine has free, within the
/// limits of the process and of its control group. The largest number where the system gives none.
int64_t AvailableMemory();

}  // namespace upswing
