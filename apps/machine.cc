#include "io/machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "apps/commands.h"
#include "core/error.h"
#include "core/text.h"
#include "io/streams.h"
#include "machine/check.h"
#include "report/figure.h"

namespace upswing {
namespace {

struct MachineArguments {
  std::string action;
  std::vector<std::string> logs;
  std::string columns, figure;
  bool as_json = false;
};

void PrintCheck(const LogCheck& check) {
  fmt::print("{}: {} rows, {:.2f} s{}\n", Printable(check.name), check.rows, check.seconds,
             check.pieces > 1 ? fmt::format(" in {} pieces", check.pieces) : "");
  for (const Finding& finding : check.findings) {
    const std::string about = finding.joint > 0
                                  ? fmt::format("{} {}", NameOf(finding.aspect), finding.joint)
                                  : NameOf(finding.aspect);
    fmt::print("  {:<8} {:<11} {}{}\n", NameOf(finding.severity), about, finding.text,
               finding.rows ? ", " + RowsText(*finding.rows) : "");
  }
}

int RunCheck(const MachineArguments& a) {
  if (!a.figure.empty()) {
    CheckFigureName(a.figure);
    CheckWritable("--figure", a.figure);
    if (a.logs.size() > 1) {
      throw BadInput(Concat("--figure: expected one log with it, got ", a.logs.size()));
    }
    CheckCanDraw();
  }
  std::vector<LogCheck> checks;
  for (const std::string& file : a.logs) {
    const std::vector<MachineLog> pieces = ReadLog(file, a.columns);
    checks.push_back(CheckLog(file, pieces));
    if (!a.figure.empty()) DrawCheck(checks.back(), pieces, a.figure);
    if (!a.as_json) PrintCheck(checks.back());
  }
  if (a.as_json) fmt::print("{}\n", CheckJson(checks));
  if (!a.figure.empty() && !a.as_json) fmt::print("written {}\n", Printable(a.figure));
  return std::ranges::any_of(checks, &LogCheck::faulty) ? 1 : 0;
}

int RunMachine(const MachineArguments& a) {
  if (a.action != "check") {
    throw BadInput(Concat("machine: expected the action check, got \"", a.action, "\""));
  }
  if (a.logs.empty()) throw BadInput("machine check: expected a log, got none");
  return RunCheck(a);
}

}  // namespace

void AddMachine(CommandLine& line) {
  MachineArguments& a = line.Runs(RunMachine);
  line.Text("action", a.action, "ACTION", "check: look for faults in logs");
  line.Require("action");
  line.Texts("log", a.logs, "LOG", "logs of a machine with two joints, .csv or .csv.gz");
  line.Text("--columns", a.columns, "FILE",
            "TOML file that names the columns and units (default: those of RealAIGym)");
  line.Text("--figure", a.figure, "FILE", "figure of a log to draw, .svg or .png");
  line.Flag("--json", a.as_json, "print JSON instead of text");
  line.Footer(
      "check prints a line for each finding. A note is a fact, such as the rate. A warning\n"
      "needs a look. A fault misleads an analysis of the log: degrees, swapped columns,\n"
      "a stuck encoder. Exit code: 0 without a fault, 1 with one, 2 if a log cannot be read.\n\n"
      "A file of columns:\n"
      "  time = {column = \"t\", unit = \"ms\"}         # s, ms, us\n"
      "  angle1 = {column = \"theta1\", unit = \"deg\"}  # rad, deg\n"
      "  angle2 = {column = \"theta2\", unit = \"deg\", factor = -1}\n"
      "  velocity1 = \"omega1\"                       # rad/s, deg/s, rpm\n"
      "  commanded1 = {column = \"u\", unit = \"mNm\"}   # Nm, mNm; also measured1, push1\n"
      "  piece = \"run\"        # a change of this column begins a separate piece\n"
      "  absolute = true      # joint 2 is measured against the vertical\n"
      "  hanging = 180        # angle that hangs, in the file's unit\n\n"
      "Examples:\n"
      "  ./upswing machine check trajectory.csv\n"
      "  ./upswing machine check logs/*.csv.gz --json\n"
      "  ./upswing machine check swing.csv --columns columns.toml --figure swing.svg\n");
}

}  // namespace upswing
