#include "cli/say.h"

#include <cstdio>

#include "os/command.h"

namespace upswing {

std::string_view LaunchCommand() { return IsInstalled() ? "upswing" : "./upswing"; }

void SayText(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stdout); }

void SayError(std::string_view message) noexcept {
  // One call per message, so that processes with the same standard error do not mix within a line.
  std::fprintf(stderr, "upswing: %.*s\n", static_cast<int>(message.size()), message.data());
}

}  // namespace upswing
