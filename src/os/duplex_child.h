#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace upswing {

/// A started program whose standard input and output are connected to this one. Ctrl-C does not
/// reach it.
class DuplexChild {
 public:
  /// Starts a program from the PATH. Throws Failure with the reason.
  explicit DuplexChild(std::vector<std::string> words);
  /// Closes the connection and waits for the end of the program.
  ~DuplexChild();
  DuplexChild(const DuplexChild&) = delete;
  DuplexChild& operator=(const DuplexChild&) = delete;

  /// Reads the bytes that have arrived, at most the size of `buffer`. Returns 0 if nothing arrives
  /// within `patience`, and nothing at the end of the output.
  std::optional<size_t> Read(std::span<char> buffer, std::chrono::milliseconds patience);
  /// Writes a short text, which fits into the system's buffer; a failure shows at the next Read.
  void Write(std::string_view text);

  /// How a program ended.
  struct End {
    int exit_code = 0;
    int signal = 0;  // that ended it; 0: none
  };
  /// Closes the connection and waits for the end of the program.
  End Finish();

 private:
  struct Process;
  std::unique_ptr<Process> process_;  // null once it has ended
};

}  // namespace upswing
