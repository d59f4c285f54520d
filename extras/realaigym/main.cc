#include "cli/program.h"

namespace upswing::realaigym {

// Each has a file *_command.cc.
void AddRealAiGym(CommandLine& line);

namespace {

constexpr Command kCommands[] = {{"realaigym", AddRealAiGym}};

}  // namespace
}  // namespace upswing::realaigym

// An exception during the report of another one ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  return upswing::MainProgram(argc, argv, upswing::realaigym::kCommands);
}
