#include <array>
#include <cstdlib>

#include "base/error.h"
#include "base/text.h"
#include "os/command.h"
#include "os/file.h"
#include "os/system.h"
#include "os/win32.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using win32::Handle;

Error SystemFailure(std::string_view what) {
  return Failure(Concat("cannot ", what, ": error ", GetLastError(), " of Windows"));
}

/// An empty temporary file that a program inherits; the system removes it with its last handle.
/// Three pipes could block each other; three files cannot.
Handle Scratch() {
  std::array<wchar_t, MAX_PATH + 1> folder{}, name{};
  GetTempPathW(static_cast<DWORD>(folder.size()), folder.data());
  GetTempFileNameW(folder.data(), L"ups", 0, name.data());
  SECURITY_ATTRIBUTES inherited{sizeof(SECURITY_ATTRIBUTES), nullptr, TRUE};
  Handle file(CreateFileW(name.data(), GENERIC_READ | GENERIC_WRITE,
                          FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, &inherited,
                          CREATE_ALWAYS, FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE,
                          nullptr));
  if (!file.valid()) throw SystemFailure("make a temporary file");
  return file;
}

void Rewind(const Handle& file) { SetFilePointer(file.get(), 0, nullptr, FILE_BEGIN); }

std::string ReadAll(const Handle& file) {
  Rewind(file);
  std::string text;
  std::array<char, 65536> buffer;
  DWORD got = 0;
  while (ReadFile(file.get(), buffer.data(), static_cast<DWORD>(buffer.size()), &got, nullptr) &&
         got > 0) {
    text.append(buffer.data(), got);
  }
  return text;
}

fs::path ModulePath(HMODULE module) {
  std::wstring path(MAX_PATH, L'\0');
  while (true) {
    const DWORD size = GetModuleFileNameW(module, path.data(), static_cast<DWORD>(path.size()));
    if (size < path.size()) return path.substr(0, size);
    path.resize(2 * path.size());
  }
}

}  // namespace

std::optional<CommandResult> RunCommand(std::vector<std::string> words, const std::string& input) {
  const std::array<Handle, 3> files{Scratch(), Scratch(), Scratch()};
  DWORD written = 0;
  if (!input.empty() && WriteFile(files[0].get(), input.data(), static_cast<DWORD>(input.size()),
                                  &written, nullptr) == 0) {
    throw SystemFailure("write a temporary file");
  }
  Rewind(files[0]);
  const win32::Process child =
      win32::Start(words, L"", files[0].get(), files[1].get(), files[2].get(), CREATE_NO_WINDOW);
  if (!child.process.valid()) {
    const DWORD error = GetLastError();
    if (error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND) return std::nullopt;
    throw SystemFailure(Concat("run ", words[0]));
  }
  const int code = win32::WaitFor(child.process);
  return CommandResult{code, 0, ReadAll(files[1]), ReadAll(files[2])};
}

const char* const kUsualPython = "python";  // as its installer and the shop name it

void SetEnvironment(const std::string& name, const std::string& value) {
  SetEnvironmentVariableW(win32::Wide(name).c_str(), win32::Wide(value).c_str());
}

fs::path ProgramPath() { return ModulePath(nullptr); }

fs::path SiblingProgram(const std::string& name) {
  return ProgramPath().replace_filename(name + ".exe");
}

fs::path CodePath() {
  HMODULE module = nullptr;
  GetModuleHandleExW(
      GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
      reinterpret_cast<const wchar_t*>(&CodePath), &module);
  return ModulePath(module);
}

void BecomeProgram(const fs::path& program, char** words) {
  // Windows cannot replace a process, so this one waits. Ctrl-C reaches both; this one ignores it.
  std::vector<std::string> all;
  for (; *words != nullptr; ++words) all.emplace_back(*words);
  const win32::Process child =
      win32::Start(all, program.wstring(), GetStdHandle(STD_INPUT_HANDLE),
                   GetStdHandle(STD_OUTPUT_HANDLE), GetStdHandle(STD_ERROR_HANDLE), 0);
  if (!child.process.valid()) return;
  SetConsoleCtrlHandler(nullptr, TRUE);
  std::_Exit(win32::WaitFor(child.process));
}

}  // namespace upswing
