#include "tools/fuzz/target.h"

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "base/error.h"

namespace upswing {

bool Accepts(const std::function<void()>& read) {
  try {
    read();
    return true;
  } catch (const Error& error) {
    const std::string_view message = error.what();
    Expect(error.exit_code() == 2 && !message.empty(), "a message and exit code 2 for bad input");
    return false;
  }
}

void Expect(bool holds, std::string_view expected) {
  if (holds) return;
  std::fprintf(stderr, "expected %.*s\n", static_cast<int>(expected.size()), expected.data());
  std::abort();
}

}  // namespace upswing

/// The entry point of libFuzzer. Any exception that TryInput lets through is a finding.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  upswing::TryInput({reinterpret_cast<const char*>(data), size});
  return 0;
}
