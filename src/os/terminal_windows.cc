#include <fcntl.h>
#include <io.h>

#include "os/terminal.h"
#include "os/win32.h"

namespace upswing {
namespace {

constexpr int kOutput = 1, kError = 2;

}  // namespace

void OpenStandardFiles() {
  for (const int fd : {0, kOutput, kError}) {
    if (_get_osfhandle(fd) < 0) (void)_open("NUL", fd == 0 ? _O_WRONLY : _O_RDONLY);
    _setmode(fd, _O_BINARY);
  }
  SetConsoleOutputCP(CP_UTF8);
  const HANDLE output = GetStdHandle(STD_OUTPUT_HANDLE);
  DWORD mode = 0;
  if (GetConsoleMode(output, &mode) != 0) {
    SetConsoleMode(output, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
  }
}

bool IsTerminal(FILE* file) { return _isatty(_fileno(file)) != 0; }

int TerminalWidth(int unknown) {
  CONSOLE_SCREEN_BUFFER_INFO screen{};
  const bool known = GetConsoleScreenBufferInfo(GetStdHandle(STD_OUTPUT_HANDLE), &screen) != 0;
  return known ? screen.srWindow.Right - screen.srWindow.Left + 1 : unknown;
}

bool OutputIsClosed() { return GetFileType(win32::HandleOf(kOutput)) == FILE_TYPE_PIPE; }

int EndByClosedOutput() { return 128 + 13; }  // as after SIGPIPE elsewhere

RedirectedOutput::RedirectedOutput(int descriptor) : output_(_dup(kOutput)), error_(_dup(kError)) {
  std::fflush(stdout);
  _dup2(descriptor, kOutput);
  _dup2(descriptor, kError);
}

RedirectedOutput::~RedirectedOutput() {
  std::fflush(stdout);
  _dup2(output_, kOutput);
  _dup2(error_, kError);
  _close(output_);
  _close(error_);
}

}  // namespace upswing
