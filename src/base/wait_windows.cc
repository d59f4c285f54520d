#include <windows.h>

#include "base/wait.h"

namespace upswing {

void Wait(const std::atomic<uint32_t>& value, uint32_t old) {
  static_assert(sizeof value == sizeof old);
  // The system only reads the number, but declares it as one to change.
  WaitOnAddress(const_cast<std::atomic<uint32_t>*>(&value), &old, sizeof old, INFINITE);
}

void WakeOne(std::atomic<uint32_t>& value) { WakeByAddressSingle(&value); }

void WakeAll(std::atomic<uint32_t>& value) { WakeByAddressAll(&value); }

}  // namespace upswing
