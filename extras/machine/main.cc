#include "cli/program.h"

namespace upswing::machine {

// Each has a file *_command.cc.
void AddMachine(CommandLine& line);
void AddRun(CommandLine& line);
void AddFake(CommandLine& line);

namespace {

constexpr Command kCommands[] = {{"machine", AddMachine}, {"run", AddRun}, {"fake", AddFake}};

}  // namespace
}  // namespace upswing::machine

// An exception during the report of another one ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  return upswing::MainProgram(argc, argv, upswing::machine::kCommands);
}
