#include "cli/python_child.h"

#include <array>
#include <cstdlib>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "cli/signals.h"
#include "os/command.h"

namespace upswing {

PythonChild::PythonChild(std::string command, const std::string& program, const std::string& job)
    : command_(std::move(command)) {
  SetEnvironment("PYTHONSAFEPATH", "1");              // no modules from the present folder
  const char* given = std::getenv("UPSWING_PYTHON");  // a name in the PATH, or a path
  std::string python = kUsualPython;
  if (given != nullptr && *given != '\0') python = given;
  try {
    child_.emplace(std::vector<std::string>{python, "-c", program, job});
  } catch (const Error& error) {
    throw Failure(Concat(command_, ": cannot run ", Printable(python), ": ", error.what(),
                         ": expected Python 3; UPSWING_PYTHON names another one"));
  }
}

std::optional<std::string> PythonChild::Next() {
  while (StopSignal() == 0) {
    const size_t end = read_.find('\n');
    if (end != std::string::npos) {
      std::string line = read_.substr(0, end);
      read_.erase(0, end + 1);
      if (line.ends_with('\r')) line.pop_back();  // Python on Windows
      return line;
    }
    // Wakes up in between, because a signal may arrive just before the call.
    std::array<char, 4096> buffer;
    const auto got = child_->Read(buffer, std::chrono::milliseconds(100));
    if (!got) break;
    read_.append(buffer.data(), *got);
  }
  return std::nullopt;
}

void PythonChild::Answer(const std::string& line) {
  // If Python has ended, Next notices.
  child_->Write(line + '\n');
}

int PythonChild::Finish() {
  const DuplexChild::End end = child_->Finish();
  if (end.signal != 0) {
    throw Failure(Concat(command_, ": Python was ended by signal ", end.signal));
  }
  return end.exit_code;
}

}  // namespace upswing
