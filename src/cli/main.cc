#include "cli/commands.h"
#include "cli/program.h"

namespace upswing {
namespace {

constexpr Command kCommands[] = {
    {"train", AddTrain},
    {"eval", AddEval},
    {"simulate", AddSimulate},
    {"grade", AddGrade},
    {"map", AddMap},
    {"plot", AddPlot},
    {"view", AddView},
    {"plant", AddPlantCommand},
    {"info", AddInfo},
    {"compare", AddCompare},
    {"study", AddStudy},
    {"completion", AddCompletion},
};

}  // namespace
}  // namespace upswing

// An exception during the report of another one ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  return upswing::MainProgram(argc, argv, upswing::kCommands);
}
