#include "cli/program.h"

namespace upswing::deploy {

// Each has a file *_command.cc.
void AddExport(CommandLine& line);
void AddDemo(CommandLine& line);

}  // namespace upswing::deploy

// An exception during the report of another one ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  using namespace upswing::deploy;
  constexpr upswing::Command kCommands[] = {{"export", AddExport}, {"demo", AddDemo}};
  return upswing::MainProgram(argc, argv, kCommands);
}
