#include <algorithm>
#include <array>

#include "base/error.h"
#include "base/text.h"
#include "os/duplex_child.h"
#include "os/win32.h"

namespace upswing {
namespace {

using win32::Handle;

/// The two ends of a pipe. A program that is started inherits one of them.
struct Pipe {
  explicit Pipe(bool child_reads) {
    HANDLE from = nullptr, to = nullptr;
    if (CreatePipe(&from, &to, nullptr, 0) == 0) throw Failure("cannot open a pipe");
    reader = Handle(from);
    writer = Handle(to);
    SetHandleInformation(child_reads ? from : to, HANDLE_FLAG_INHERIT, HANDLE_FLAG_INHERIT);
  }
  Handle reader, writer;
};

}  // namespace

struct DuplexChild::Process {
  Handle process, output, input;
};

DuplexChild::DuplexChild(std::vector<std::string> words) : process_(std::make_unique<Process>()) {
  Pipe input(/*child_reads=*/true), output(/*child_reads=*/false);
  win32::Process child = win32::Start(words, L"", input.reader.get(), output.writer.get(),
                                      GetStdHandle(STD_ERROR_HANDLE), CREATE_NEW_PROCESS_GROUP);
  if (!child.process.valid()) {
    const DWORD error = GetLastError();
    process_.reset();
    throw Failure(error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND
                      ? "there is no such program"
                      : Concat("error ", error, " of Windows"));
  }
  *process_ = {std::move(child.process), std::move(output.reader), std::move(input.writer)};
}

DuplexChild::~DuplexChild() {
  if (process_) Finish();
}

std::optional<size_t> DuplexChild::Read(std::span<char> buffer,
                                        std::chrono::milliseconds patience) {
  // A wait for a pipe cannot be limited, so it looks again and again.
  constexpr DWORD kPause = 10;  // ms
  DWORD waiting = 0;
  for (DWORD waited = 0;; waited += kPause) {
    if (PeekNamedPipe(process_->output.get(), nullptr, 0, nullptr, &waiting, nullptr) == 0) {
      return std::nullopt;
    }
    if (waiting > 0) break;
    if (waited >= patience.count()) return 0;
    Sleep(kPause);
  }
  DWORD got = 0;
  const DWORD most = std::min(waiting, static_cast<DWORD>(buffer.size()));
  if (ReadFile(process_->output.get(), buffer.data(), most, &got, nullptr) == 0)
    return std::nullopt;
  return got;
}

void DuplexChild::Write(std::string_view text) {
  DWORD written = 0;
  WriteFile(process_->input.get(), text.data(), static_cast<DWORD>(text.size()), &written, nullptr);
}

DuplexChild::End DuplexChild::Finish() {
  process_->input.Close();
  process_->output.Close();
  const int code = win32::WaitFor(process_->process);
  process_.reset();
  return {code, 0};
}

}  // namespace upswing
