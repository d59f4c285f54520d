#pragma once

#include <cstdio>

/// Standard input, output and error, and the terminal.
namespace upswing {

/// Opens standard input, output and error if they are closed, so that none of our files gets their
/// numbers. They still behave as closed: input is empty, and every write fails. A failed write then
/// returns an error, which gets a message, instead of ending the program. On Windows, bytes pass as
/// they are, and the terminal takes UTF-8 and colours.
void OpenStandardFiles();

/// The words of the command line in UTF-8, ending with a null.
char** Utf8Words(int argc, char** argv);

/// Whether a standard file is a terminal.
bool IsTerminal(FILE* file);
/// Width of standard output's terminal in columns; `unknown` if there is no terminal.
int TerminalWidth(int unknown);

/// Whether standard output has no reader any more, as after `| head -1` has ended. Call it after a
/// failed write.
bool OutputIsClosed();
/// Ends as programs usually do when the reader of their output has ended. Returns the exit code if
/// the system has no such end.
int EndByClosedOutput();

/// Sends standard output and error to an open file during its lifetime.
class RedirectedOutput {
 public:
  explicit RedirectedOutput(int descriptor);
  ~RedirectedOutput();
  RedirectedOutput(const RedirectedOutput&) = delete;
  RedirectedOutput& operator=(const RedirectedOutput&) = delete;

 private:
  int output_, error_;  // copies of the present ones
};

}  // namespace upswing
