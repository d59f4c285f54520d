#include "cli/commands.h"
#include "cli/program.h"

namespace upswing {
namespace {

/// The only list of commands, in the order of --help. ./upswing prints it, too, one line each.
constexpr CommandEntry kCommands[] = {
    {"train", "Train an agent until it solves the task", AddTrain},
    {"eval", "Evaluate a policy over many episodes", AddEval},
    {"bounds", "Search for the best episodes and compare policies with them", AddBounds},
    {"simulate", "Write one rollout of a policy or of given torques as CSV", AddSimulate},
    {"map", "Map success over two quantities of plant, sensors or start", AddMap},
    {"plot", "Draw one episode of a policy as figures", AddPlot},
    {"view", "Show policies in a window, or record them as a film or pictures", AddView},
    {"info", "Describe and check a policy or a run, or describe this machine", AddInfo},
    {"compare", "Compare runs over their seeds, with intervals and curves", AddCompare},
    {"study", "Train variants of the settings, each with many seeds", AddStudy},
    {"export", "Export policies as ONNX or C, or into the page", AddExport},
    {"realaigym", "Score a policy by the rules of RealAIGym, or search for one", AddRealAiGym},
    {"machine", "Check logs of a real machine, identify its twin, validate it", AddMachine},
    {"run", "Drive a real machine or its twin with a policy", AddRun},
    {"fake", "Play a machine for `run`: a twin behind UDP or a terminal", AddFake},
    {"bench", "Measure the speed of the program on this machine", nullptr},
    {"demo", "Serve the page in which policies swing up the pendulum live", AddDemo},
    {"docs", "Build the documentation, or the whole web site", nullptr},
    {"package", "Build packages: tarball, Debian package, Python wheels", nullptr},
    {"python", "Run Python with the package upswing", nullptr},
    {"test", "Build and run all tests", nullptr},
};

}  // namespace
}  // namespace upswing

// An exception during the report of another one ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  return upswing::MainProgram(
      argc, argv, upswing::kCommands,
      "Examples:\n"
      "  ./upswing train                   train the default agent until it solves the task\n"
      "  ./upswing eval runs/d3qn-seed1    evaluate its best policy\n"
      "  ./upswing compare runs            compare the agents in runs over their seeds\n"
      "  ./upswing train --help            show all settings with their defaults\n");
}
