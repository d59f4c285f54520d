#include "report/gnuplot.h"

#include "core/error.h"
#include "core/text.h"
#include "io/command.h"

namespace upswing {
namespace {

/// The line of gnuplot's message with the error, without its place in the script.
std::string ErrorIn(const std::string& message) {
  std::string last;
  for (const std::string_view line : Split(message, '\n')) {
    if (!line.empty()) last = line;
    if (const size_t colon = line.find(": "); line.starts_with('"') && colon != line.npos) {
      return std::string(line.substr(colon + 2));
    }
  }
  return last.empty() ? "it said nothing" : last;
}

}  // namespace

std::string RunGnuplot(const std::string& script) {
  // Of "-" it would read each byte by itself.
  const std::optional<CommandResult> done = RunCommand({"gnuplot", "-d", "/dev/stdin"}, script);
  if (!done) {
    throw Failure(
        "figure: expected the program gnuplot (Debian's package gnuplot-nox), found none in PATH");
  }
  if (done->signal != 0) {
    throw Failure(Concat("figure: gnuplot was ended by signal ", done->signal));
  }
  if (done->exit_code != 0) {
    throw Failure(Concat("figure: gnuplot failed: ", ErrorIn(done->errors)));
  }
  return done->output;
}

}  // namespace upswing
