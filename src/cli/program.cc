#include "cli/program.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <system_error>
#include <vector>

#include "base/error.h"
#include "base/simd.h"
#include "base/text.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "os/command.h"
#include "os/file.h"
#include "os/terminal.h"

namespace upswing {
namespace {

constexpr const char* kExamples =
    "  ./upswing train                   train the default agent until it solves the task\n"
    "  ./upswing eval runs/d3qn-seed1    evaluate its best policy\n"
    "  ./upswing compare runs            compare the agents in runs over their seeds\n"
    "  ./upswing train --help            show all settings with their defaults\n";

/// The exit code; another one if the output cannot be written.
int Finish(int exit_code) {
  std::cout.flush();
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good()) return exit_code;
  if (OutputIsClosed()) return EndByClosedOutput();
  SayError(Concat("cannot write the output: ", std::strerror(errno)));
  return 1;
}

/// Selects the vector instructions named in the environment variable UPSWING_VECTORS, if it is set.
/// They reproduce the results of another processor to the bit.
void ChooseVectors() {
  const char* path = std::getenv("UPSWING_VECTORS");
  if (path != nullptr && *path != '\0') UseSimdPath(path);
}

/// Runs another program instead if the called command is one of its own.
void RunOtherProgram(int argc, char** argv, std::span<const Command> own) {
  const std::span<const CommandEntry> table = CommandTable();
  const std::string_view name = CalledCommand(argc, argv);
  const auto entry = std::ranges::find(table, name, &CommandEntry::name);
  if (entry == table.end() || std::ranges::find(own, name, &Command::name) != own.end()) return;
  if (!entry->program.empty()) BecomeProgram(SiblingProgram(std::string(entry->program)), argv);
  const std::filesystem::path documents =
      ProgramPath().parent_path().parent_path() / "share/doc/upswing/html/index.html";
  if (name == "docs" && IsInstalled() && IsFile(documents)) {
    throw BadInput(Concat("docs: the documentation of this package is ", documents.string(),
                          "; ./upswing docs in the source repository builds it"));
  }
  throw BadInput(Concat(name, ": expected ./upswing ", name, " in the source repository",
                        entry->program.empty() ? "" : Concat(", which builds ", entry->program)));
}

/// The command line with `help COMMAND` as `COMMAND --help`, and no words as `--help`.
std::vector<char*> WithHelpLast(int argc, char** argv) {
  static char help[] = "--help";  // a word may be written to
  std::vector<char*> words(argv, argv + argc);
  const bool asks =
      argc > 1 && (std::strcmp(argv[1], "help") == 0 ||
                   (argc > 2 && argv[2][0] != '-' &&
                    (std::strcmp(argv[1], "-h") == 0 || std::strcmp(argv[1], help) == 0)));
  if (asks) words.erase(words.begin() + 1);
  if (asks || argc == 1) words.push_back(help);
  words.push_back(nullptr);
  return words;
}

int Main(int argc, char** argv, std::span<const Command> own) {
  try {
    RunOtherProgram(argc, argv, own);
    ChooseVectors();
    return Finish(RunProgram(argc, argv, CommandTable(), own, kExamples));
  } catch (const Error& error) {
    SayError(OneLine(error.what()));
    return error.exit_code();
  } catch (const std::filesystem::filesystem_error& error) {
    const Error of_path = PathError("cannot use", error.path1(), error.code().value());
    SayError(OneLine(of_path.what()));
    return of_path.exit_code();
  } catch (const std::bad_alloc&) {
    SayError("out of memory");
    return 1;
  } catch (const std::exception& error) {
    if (OutputIsClosed() && std::ferror(stdout) != 0) return EndByClosedOutput();
    SayError(OneLine(error.what()));
    return 1;
  }
}

}  // namespace

int MainProgram(int argc, char** argv, std::span<const Command> own) {
  ListenToSignals();
  OpenStandardFiles();
  std::vector<char*> words = WithHelpLast(argc, Utf8Words(argc, argv));
  return Main(static_cast<int>(words.size()) - 1, words.data(), own);
}

}  // namespace upswing
