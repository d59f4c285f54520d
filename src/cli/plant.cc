#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/python_child.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "judge/rollout.h"
#include "os/file.h"
#include "os/streams.h"
#include "pendulum/timestep.h"
#include "runs/plant_file.h"

namespace upswing {

/// The program in Python that reads models: the text of python/upswing/_plant.py.
const char* PlantProgram();

namespace {

// What a plant file cannot hold and --drop leaves out, as python/upswing/_plant.py names it.
constexpr std::array kDroppable{
    "stiffness", "nonlinear-damping", "limits", "frictionloss", "contacts",  "equality", "tendons",
    "fluid",     "gravcomp",          "tilt",   "offset",       "actuators", "includes"};

/// Largest difference (rad) that counts as none. Both programs take the same Runge-Kutta steps, so
/// only rounding differs, by about 1e-16 of each angle and step. Chaotic motions multiply that by
/// up to 1e5 in a second. A parameter that is wrong by 1e-5 of its value moves the joints by more.
constexpr double kTolerance = 1e-6;

struct PlantArguments {
  std::string model, out = "-";
  std::vector<std::string> drop;
  double motor = 0;                      // 0: not given
  double torque_limit = 0, length2 = 0;  // N·m, m; 0: not given
  bool convert_friction = false, overwrite = false;
};

/// The instructions of the Python program. Throws BadInput.
nlohmann::json JobOf(const PlantArguments& a) {
  for (const std::string& name : a.drop) {
    if (std::ranges::find(kDroppable, name) != kDroppable.end()) continue;
    throw BadInput(Concat("--drop: expected one of ", Join(kDroppable, ", "), ", got \"",
                          Printable(name), "\""));
  }
  if (a.convert_friction && std::ranges::find(a.drop, "frictionloss") != a.drop.end()) {
    throw BadInput("--convert-friction: expected no --drop frictionloss with it, which drops it");
  }
  const auto given = [](double value) {
    return value > 0 ? nlohmann::json(value) : nlohmann::json();
  };
  return {{"file", a.model},
          {"drop", a.drop},
          {"motor", static_cast<int>(a.motor)},
          {"torque_limit", given(a.torque_limit)},
          {"length2", given(a.length2)},
          {"convert_friction", a.convert_friction},
          {"friction_slope", kFrictionSlope}};
}

/// Control period of the compared motions, s: that of the built-in plant, in the plant's natural
/// time. Rounding grows beyond the tolerance in longer motions.
double PeriodFor(const Plant& plant) {
  return std::clamp(kControlPeriod * ScaleOf(plant).time, kShortestPeriod, kLongestPeriod);
}

/// Largest difference (rad) between the motions of a plant in this program and those of the model,
/// with control periods of `period` (s). `read` has the start states, torques and angles.
double LargestDifference(const Plant& plant, double period, const nlohmann::json& read) {
  double largest = 0;
  for (size_t n = 0; n < read["starts"].size(); ++n) {
    const auto start = read["starts"][n].get<std::array<double, 4>>();
    const auto angles = read["angles"][n].get<std::vector<std::array<double, 2>>>();
    RolloutConfig config;
    config.env.plants = {plant};
    config.start = PendulumState{start[0], start[1], start[2], start[3]};
    config.schedule = read["torques"][n].get<std::vector<double>>();
    config.env.control_period = period;
    config.seconds = static_cast<double>(config.schedule.size()) * period;
    const Rollout rollout = RunRollout(config);
    for (size_t k = 0; k < angles.size(); ++k) {
      const PendulumState& s = rollout.rows.at(k).state;
      largest = std::max({largest, std::abs(s.q1 - angles[k][0]), std::abs(s.q2 - angles[k][1])});
    }
  }
  return largest;
}

/// The next object of the Python program, or nothing if it failed; `code` is then the exit code.
std::optional<nlohmann::json> NextOf(PythonChild& reader, int& code) {
  const std::optional<std::string> line = reader.Next();
  nlohmann::json read = line ? nlohmann::json::parse(*line, nullptr, false) : nlohmann::json();
  if (read.is_object()) return read;
  code = reader.Finish();
  if (StopSignal() != 0) code = 128 + StopSignal();
  if (code != 0) return std::nullopt;
  throw Failure("plant: Python read nothing: expected UPSWING_PYTHON to name a Python");
}

/// Throws BadInput if --out is a file that the model includes.
void ExpectNoPart(const std::string& out, const nlohmann::json& files) {
  for (const auto& file : files) {
    std::error_code error;
    const auto part = file.get<std::string>();
    if (!std::filesystem::equivalent(out, part, error)) continue;
    throw BadInput(Concat("--out: expected another file than ", Printable(part),
                          " of the model, which would be lost"));
  }
}

int RunPlant(const PlantArguments& a) {
  CheckNewOutput("--out", a.out, a.overwrite);
  int code = 0;
  InstallSignalHandlers("");
  PythonChild reader("plant", PlantProgram(),
                     JobOf(a).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  const std::optional<nlohmann::json> model = NextOf(reader, code);
  if (!model) return code;
  const std::string where = Concat("plant of ", Printable(a.model));
  const Plant plant = ParsePlantFile((*model)["toml"].get<std::string>(), where).plant;
  // Both have to take the steps that the plant needs.
  const double period = PeriodFor(plant);
  reader.Answer(Concat(FormatNumber(period), " ", PhysicsStepsFor(plant, period, where)));
  const std::optional<nlohmann::json> read = NextOf(reader, code);
  if (!read) return code;
  if (code = reader.Finish(); code != 0) return code;
  ExpectNoPart(a.out, (*read)["files"]);

  const size_t motions = (*read)["starts"].size();
  const double difference = LargestDifference(plant, period, *read);
  const double seconds = static_cast<double>((*read)["torques"].at(0).size()) * period;
  const std::string check =
      fmt::format("{} random motions of {:.2g} s differ from MuJoCo's by at most {:.2g} rad",
                  motions, seconds, difference);
  if (!(difference <= kTolerance)) {
    throw Failure(Concat(Printable(a.model), ": ", check, ", expected at most ", kTolerance,
                         ": the model has something that a plant file cannot hold"));
  }
  const std::string text =
      Concat("# Plant of ", Printable(a.model), ", read by `upswing plant`.\n# ", check, ".\n",
             (*read)["toml"].get<std::string>());
  if (IsStandardStream(a.out)) {
    WriteOutput(a.out, text);
    return 0;
  }
  WriteFileAtomically(a.out, text);  // replaces a link: its target may be of another folder
  fmt::print("{}: {}\n", Printable(a.out), check);
  for (const auto& remark : (*read)["remarks"]) {
    fmt::print("  {}\n", Printable(remark.get<std::string>()));
  }
  return 0;
}

}  // namespace

void AddPlantCommand(CommandLine& line) {
  PlantArguments& a = line.Runs(RunPlant);
  line.Text("model", a.model, "FILE.xml|FILE.urdf",
            "MJCF or URDF file of a double pendulum, with its includes and meshes in its folder");
  line.Require("model");
  line.Text("--out", a.out, "FILE", "plant file (TOML) to write; -: standard output (default -)");
  AddOverwrite(line, a.overwrite);
  line.Repeated("--drop", a.drop, "NAME",
                Concat("property to leave out, because a plant file cannot hold it (repeatable): ",
                       Join(kDroppable, ", ")));
  line.Flag(
      "--convert-friction", a.convert_friction,
      "write MuJoCo's frictionloss c as the dry friction c·2/π·atan(100 w), which is c at speed");
  const Options of_plant = OptionsOf(Plant());
  Options own;
  Option& motor = own.Add(&a.motor, "motor", {1, 2}, "",
                          "joint whose motor the plant has; the other joint's motor is left out");
  motor.step = 1;
  motor.usual = "the only motor";
  own.Add(&a.torque_limit, "torque_limit", of_plant.Get("torque_limit")->range, "N·m",
          "largest torque of the motor")
      .usual = "as in the file";
  own.Add(&a.length2, "length2", of_plant.Get("length2")->range, "m",
          "length of link 2, which only the task's heights need")
      .usual = "the distance to its farthest site, else to the end of its farthest shape";
  line.Arguments(own);
  line.Notes(
      "The command refuses (exit code 2) what a plant file cannot hold, with its value: a cart, a\n"
      "free base, a third joint, two motors, servos, springs, joint limits that a swing-up\n"
      "reaches. It also refuses shapes that touch, MuJoCo's frictionloss, tendons, fluids and a\n"
      "tilted plane. It then moves MuJoCo's model and the plant from 200 random states under\n"
      "random torques for 1 s in the time of the built-in plant, in the same Runge-Kutta steps.\n"
      "If an angle differs by more than 1e-6 rad, it writes nothing and ends with exit code 1.\n\n"
      "Python reads the file, with MuJoCo: `python3`, or the one that UPSWING_PYTHON names.\n");
  line.Examples(
      "  ./upswing plant acrobot.xml --out acrobot.toml\n"
      "  ./upswing plant robot.urdf --out robot.toml --drop limits --convert-friction\n"
      "  ./upswing plant arm.xml --out arm.toml --motor 2 --torque-limit 3 --drop contacts\n"
      "  ./upswing eval tvlqr --plant acrobot.toml --made-for acrobot.toml\n");
}

}  // namespace upswing
