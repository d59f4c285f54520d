#include "cli/program.h"

namespace upswing::machine {

// Each has a file *_command.cc.
void AddMachine(CommandLine& line);
void AddRun(CommandLine& line);
void AddFake(CommandLine& line);

}  // namespace upswing::machine

// An exception during the report of another one ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  using namespace upswing::machine;
  constexpr upswing::Command kCommands[] = {
      {"machine", AddMachine}, {"run", AddRun}, {"fake", AddFake}};
  return upswing::MainProgram(argc, argv, kCommands);
}
