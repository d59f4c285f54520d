#include "cli/program.h"

namespace upswing::deploy {

// Each has a file *_command.cc.
void AddExport(CommandLine& line);
void AddDemo(CommandLine& line);

namespace {

constexpr Command kCommands[] = {{"export", AddExport}, {"demo", AddDemo}};

}  // namespace
}  // namespace upswing::deploy

// An exception during the report of another one ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  return upswing::MainProgram(argc, argv, upswing::deploy::kCommands);
}
