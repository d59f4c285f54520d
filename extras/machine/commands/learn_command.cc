#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "extras/machine/drive/learn.h"
#include "extras/machine/drive/policy_controller.h"
#include "os/file.h"
#include "os/host.h"

namespace upswing::machine {
namespace {

struct LearnArguments {
  std::string link, out, robot = "pendubot";
  LearnConfig config;
  std::vector<FlagValue> limits;  // the given ones
  int64_t seed = 1, threads = 0;
  bool draw = false;
};

std::unique_ptr<MachineLink> g_learned;  // global for signal handlers, which may come until the end

/// The command that runs the controller again.
std::string CommandOf(const LearnArguments& a, const Limits& limits, const LearnResult& r) {
  const PolicyArguments& controller = r.controller;
  std::string text = fmt::format("{} run {}", LaunchCommand(), controller.name);
  for (const FlagValue& flag : controller.flags) {
    text += fmt::format(" {} {}", FlagOf(flag.name), ShellQuoted(flag.text));
  }
  for (const std::string& change : controller.made_for) text += " --made-for " + change;
  const bool in_process =
      ParseLink(a.link, /*listens=*/false).transport == LinkAddress::Transport::kTwin;
  const std::string twin = ShellQuoted((std::filesystem::path(a.out) / "twin.toml").string());
  text += in_process ? fmt::format(" --link {}", twin)
                     : fmt::format(" --link {} --twin {}", ShellQuoted(a.link), twin);
  return text + fmt::format(
                    " --compensation {} --passive-torque {} --max-torque {} "
                    "--max-angle {} --max-velocity {} --max-energy {} --hz {}",
                    r.compensation, limits.passive_torque, limits.torque, limits.angle,
                    limits.velocity, limits.energy, a.config.hz);
}

/// The settings of the session. Throws BadInput for missing or wrong arguments.
LearnConfig LearnConfigOf(const LearnArguments& a) {
  LearnConfig config = a.config;
  SetFlags(OptionsOf(config.limits), a.limits);
  const bool has_torque = std::ranges::count(a.limits, "max_torque", &FlagValue::name) > 0;
  if (config.length > 0 && !has_torque) {
    throw BadInput("--length: expected --max-torque with it, got none");
  }
  config.limits = config.DefaultLimits(config.limits.torque);
  SetFlags(OptionsOf(config.limits), a.limits);
  config.seed = static_cast<uint64_t>(a.seed);
  config.actuated_joint = static_cast<int>(*ParseRobot(a.robot));
  config.Check();
  return config;
}

/// Opens the link to a machine, or to a twin that hangs at rest in simulated time.
std::unique_ptr<MachineLink> OpenLink(const LearnArguments& a) {
  const LinkAddress address = ParseLink(a.link, /*listens=*/false);
  const bool is_twin = address.transport == LinkAddress::Transport::kTwin;
  const Twin twin = is_twin ? ReadTwin(address.place, "--link", kLinkForms) : Twin();
  if (a.draw && twin.covariance.empty()) {
    throw BadInput("--draw: expected a twin with [covariance] as --link, got none");
  }
  if (!is_twin) return std::make_unique<ChannelLink>(Channel::Connect(address));
  const auto seed = static_cast<uint64_t>(a.seed);
  Rng rng(seed, "learn: machine");
  return std::make_unique<TwinLink>(a.draw ? DrawTwin(twin, rng) : twin, PendulumState(), seed);
}

/// Learns on g_learned until a signal stops it. Prints each step, and appends it to `report`. If
/// there was no run, removes its log, so that the command can be repeated.
LearnResult LearnAndReport(const LearnConfig& config, const std::filesystem::path& out,
                           ThreadPool& pool, std::string& report) {
  const auto say = [&](const std::string& line) {
    fmt::print(stderr, "{}\n", Printable(line));
    report += line + "\n";
  };
  try {
    return Learn(config, *g_learned, out, &pool, say, [] { return StopSignal() != 0; });
  } catch (const Error&) {
    std::error_code error;
    std::filesystem::remove(out / "log-01.csv", error);
    throw;
  }
}

/// The times and attempts that a session used.
std::string UsedText(const LearnResult& r) {
  return fmt::format("{:.1f} s of motion, {:.1f} s of computing, {}", r.motion, r.computing,
                     Counted(r.tries, "attempt"));
}

/// Writes the file report.txt: `steps`, the result, and the command that runs the controller again.
void WriteReport(const LearnArguments& a, const Limits& limits, const LearnResult& r,
                 const std::string& steps) {
  std::string text = steps;
  text += r.reason.empty() ? "balanced: " : fmt::format("not balanced, {}: ", r.reason);
  text += UsedText(r) + "\n";
  if (r.tries > 0) text += CommandOf(a, limits, r) + "\n";
  WriteNamedFile(std::filesystem::path(a.out) / "report.txt", text);
}

/// Prints the result and returns the exit code. Throws Failure if the machine did not balance.
int SayResult(const LearnArguments& a, const Limits& limits, const LearnResult& r) {
  const std::string used = UsedText(r);
  if (StopSignal() != 0) {
    fmt::print(stderr, "stopped: {}; written {}\n", used, Printable(a.out));
    return 128 + StopSignal();
  }
  if (!r.reason.empty()) throw Failure(fmt::format("not balanced: {} ({})", r.reason, used));
  fmt::print("balanced for {:.1f} s: {}\n{}\nwritten {}\n", r.balanced, used,
             CommandOf(a, limits, r), Printable(a.out));
  return 0;
}

int RunLearn(const LearnArguments& a) {
  const LearnConfig config = LearnConfigOf(a);
  g_learned = OpenLink(a);
  CheckFree(a.out);
  NewFolder folder(a.out);
  GuardMotors([] { g_learned->SwitchOffAtOnce(); });
  ThreadPool pool(ResolveThreads(a.threads));
  std::string steps;
  const LearnResult result = LearnAndReport(config, a.out, pool, steps);
  folder.Keep();
  WriteReport(a, config.limits, result, steps);
  return SayResult(a, config.limits, result);
}

}  // namespace

void AddLearn(CommandLine& line) {
  LearnArguments& a = line.Runs(RunLearn);
  line.Text("--link", a.link, "LINK",
            "machine: udp:HOST:PORT or serial:DEVICE[:BAUD], or a twin (file or shipped plant) to "
            "play it in simulated time");
  line.Text("--out", a.out, "FOLDER", "new folder to write: logs, twin.toml, report.txt");
  line.Require("--link");
  line.Require("--out");
  line.Text("--robot", a.robot, "ROBOT",
            "pendubot (motor at joint 1) or acrobot (joint 2) (default pendubot)");
  line.Arguments(OptionsOf(a.config));
  line.Require("--encoder-counts");
  line.Settings(OptionsOf(a.config.limits), a.limits);
  AddSeed(line, a.seed, "the excitations and of simulated tries");
  AddThreads(line, a.threads);
  line.Flag("--draw", a.draw,
            "with a twin as --link: play a machine drawn from the twin's covariance");
  line.Notes(
      "The links must hang at rest. Torques grow until they move. The program identifies a twin\n"
      "from this motion, designs a controller on it and tries it. After a failed try it\n"
      "identifies the twin again. You need to know --max-torque, --encoder-counts and the signs\n"
      "of angles and torques (docs/howto/real-machine.md). Give --length for a machine of another\n"
      "size than RealAIGym's: times and limits follow it. Beyond a limit and at Ctrl-C the loop\n"
      "brakes. A second Ctrl-C switches the motors off at once.\n"
      "Exit code: 0 if the machine balanced for --hold, 130 after Ctrl-C, else 1.\n");
  line.Examples(
      "  ./upswing machine learn --link realaigym-twin --encoder-counts 16384 --out rehearsal\n"
      "  ./upswing machine learn --link serial:/dev/ttyACM0 --encoder-counts 4096 \\\n"
      "    --max-torque 3 --max-velocity 15 --out today\n");
}

}  // namespace upswing::machine
