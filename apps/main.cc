#include "apps/commands.h"
#include "apps/program.h"

namespace upswing {
namespace {

/// In the order of --help.
constexpr CommandEntry kCommands[] = {
    {"train", "Train an agent until the task is solved", AddTrain},
    {"eval", "Evaluate a policy over many episodes", AddEval},
    {"bounds", "Search for the best episodes, and compare policies with them", AddBounds},
    {"simulate", "Write one rollout of a policy, of given torques, or of none as CSV", AddSimulate},
    {"map", "Map how policies do on other plants or from other starts", AddMap},
    {"plot", "Draw one episode of a policy", AddPlot},
    {"view", "Show policies at work in a window, or record them as a film", AddView},
    {"info", "Describe and check a policy or a run, or describe this machine", AddInfo},
    {"compare", "Compare trainings over their seeds, with intervals and curves", AddCompare},
    {"study", "Train variants of the settings, many seeds each", AddStudy},
    {"export", "Policies as ONNX or C or in the page; numbers to test other readers by", AddExport},
    {"realaigym", "Score a policy by the rules of the benchmark RealAIGym, or search one",
     AddRealAiGym},
    {"bench", "Measure how fast it is on this machine", nullptr},
    {"demo", "Serve the page where the pendulum is swung up live", nullptr},
    {"docs", "Build the documentation, or the whole web site", nullptr},
    {"python", "Run Python with the package upswing", nullptr},
    {"test", "Build and run every test", nullptr},
};

}  // namespace
}  // namespace upswing

// What is thrown while an exception is reported ends us.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  return upswing::MainProgram(
      argc, argv, upswing::kCommands,
      "Examples:\n"
      "  ./upswing train                      train the default agent until the task is solved\n"
      "  ./upswing eval runs/d3qn-seed1       evaluate its best policy\n"
      "  ./upswing compare runs               compare the agents in runs over their seeds\n"
      "  ./upswing train --help               every setting, with its default\n");
}
