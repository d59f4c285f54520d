#pragma once

#include <cstdint>
#include <string>

namespace upswing {

/// "AMD EPYC 9454P", as the system has it; "unknown" where it does not say.
std::string CpuModel();

/// Bytes of memory that this process can still ask for: what the machine has free, within the
/// limits of the process and of its control group. The largest number where the system gives none.
int64_t AvailableMemory();

}  // namespace upswing
