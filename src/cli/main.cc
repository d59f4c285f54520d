#include "cli/commands.h"
#include "cli/program.h"

// An exception during the report of another one ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  using namespace upswing;
  constexpr Command kCommands[] = {
      {"train", AddTrain},
      {"eval", AddEval},
      {"simulate", AddSimulate},
      {"grade", AddGrade},
      {"map", AddMap},
      {"plot", AddPlot},
      {"view", AddView},
      {"info", AddInfo},
      {"compare", AddCompare},
      {"study", AddStudy},
      {"completion", AddCompletion},
  };
  return MainProgram(argc, argv, kCommands);
}
