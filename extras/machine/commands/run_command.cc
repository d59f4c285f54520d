#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "agents/arguments.h"
#include "base/error.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/signals.h"
#include "extras/machine/drive/control_loop.h"
#include "extras/machine/drive/policy_controller.h"
#include "extras/machine/drive/real_time.h"
#include "os/streams.h"
#include "pendulum/start_text.h"
#include "runs/plant_file.h"

namespace upswing::machine {
namespace {

/// Settings whose defaults follow the size of the machine.
struct SizedSettings {
  Limits limits;
  MachineSensors sensors{.velocity_share = 0.2, .velocity_dead_zone = 0.1};

  /// The defaults for a machine like this twin.
  static SizedSettings For(const Twin& twin) {
    SizedSettings settings;
    settings.limits = Limits::For(twin);
    settings.sensors.velocity_dead_zone *= ScaleOverUsual(twin.plant).velocity();
    return settings;
  }

  void Describe(Options& o) {
    o.Section("Options");
    o.Add(&sensors.velocity_share, "velocity_share", {0.001, 1}, "",
          "without a twin: share of the newest difference in the low-passed velocities");
    o.Add(&sensors.velocity_dead_zone, "velocity_dead_zone", {0, 100}, "rad/s",
          "without a twin: velocity below which the controller sees 0");
    limits.Describe(o);
  }
};

struct RunArguments {
  PolicyArguments policy;
  std::string link, twin, robot, log, start = "hanging";
  std::vector<FlagValue> sized;  // the given ones of SizedSettings
  int64_t seed = 1;
  double hz = 500, seconds = 10, compensation = 0;
  bool differences = false, draw = false, force = false;
};

std::unique_ptr<MachineLink> g_link;  // global for signal handlers, which may come until the end

/// Throws BadInput if a serial line is too slow for a frame per cycle in each direction.
void CheckBaud(const LinkAddress& link, int64_t hz) {
  constexpr int64_t kBitsPerByte = 10;  // start, 8 bits, stop
  const int64_t needed = hz * kBitsPerByte * static_cast<int64_t>(kFrameBytes);
  if (link.transport == LinkAddress::Transport::kSerial && link.number < needed) {
    throw BadInput(Concat("--link: expected at least ", needed, " bit/s for ", hz,
                          " cycles per second, got ", link.number));
  }
}

void PrintSummary(const LoopSummary& s, const LinkCounts& counts, const Supervisor& supervisor,
                  bool simulated) {
  std::string end = "not upright at its end";
  if (s.upright > 0) end = fmt::format("the last {:.2f} s upright", s.upright);
  fmt::print("  ran      {:.2f} s, {}\n", s.driven, end);
  const double share = static_cast<double>(s.on_time) / static_cast<double>(s.cycles);
  fmt::print(
      "  cycles   {}, {:.3f}% begin within {:g} ms of the deadline, the latest after {:.2f} ms, {} "
      "left out\n",
      s.cycles, 100 * share, 1e3 * LoopSummary::kOnTime, 1e3 * s.latest, s.missed);
  if (!simulated) {
    fmt::print(
        "  link     {} commands, {} readings; {} cycles without one, {} lost, {} doubled, "
        "{} too old, {} broken bytes\n",
        counts.sent, counts.received, s.unanswered, counts.lost, counts.duplicates, counts.old,
        counts.broken);
  }
  fmt::print("  torque   cut in {} cycles; the controller takes up to {:.2f} ms\n",
             supervisor.clipped(), 1e3 * s.longest_act);
}

/// The machine as far as it is known: its twin, or the plant of the policy.
Twin KnownMachine(const LoadedPolicy& policy, const std::optional<Twin>& twin) {
  if (twin) return *twin;
  Twin machine;
  machine.plant = policy.plant;
  return machine;
}

/// The given settings, and the defaults for the size of the machine.
SizedSettings SettingsFor(const RunArguments& a, const Twin& machine) {
  SizedSettings settings = SizedSettings::For(machine);
  SetFlags(OptionsOf(settings), a.sized);
  return settings;
}

/// The supervisor with the limits of the run and the motors of the machine.
Supervisor SupervisorOf(const RunArguments& a, const SizedSettings& settings,
                        const LoadedPolicy& policy, const std::optional<Twin>& twin) {
  const int joint = static_cast<int>(RobotOf(policy));
  const Limits& limits = settings.limits;
  Joints motor{limits.passive_torque, limits.passive_torque};
  motor[joint - 1] = twin ? twin->plant.torque_limit : limits.torque;
  const MachineSensors sensors = twin ? twin->sensors : settings.sensors;
  return Supervisor({.limits = limits,
                     .scale = ScaleOverUsual(KnownMachine(policy, twin).plant),
                     .start = ParsePendulumStart(a.start),
                     .motor_limit = motor,
                     .actuated_joint = joint,
                     .angle_range = sensors.angle_range,
                     .quantum = sensors.quantum});
}

/// Opens the link to the twin or the machine, as g_link.
void OpenLink(const RunArguments& a, const std::optional<Twin>& twin, const LinkAddress& address) {
  if (address.transport != LinkAddress::Transport::kTwin) {
    g_link = std::make_unique<ChannelLink>(Channel::Connect(address));
    return;
  }
  const auto seed = static_cast<uint64_t>(a.seed);
  Rng rng(seed, "loop: machine");
  g_link = std::make_unique<TwinLink>(a.draw ? DrawTwin(*twin, rng) : *twin,
                                      ParsePendulumStart(a.start), seed);
}

/// Prints the limits that follow the size of a machine unlike RealAIGym's.
void PrintLimits(const Limits& limits, const Twin& machine) {
  const Scale scale = ScaleOverUsual(machine.plant);
  if (scale == Scale()) return;
  fmt::print(
      "  another size than RealAIGym's: times × {:.3g}, torques × {:.3g}; limits {:.3g} rad/s, "
      "{:.3g} N·m, other joint {:.3g} N·m; braking {:.3g} N·m·s/rad for {:.3g} s\n",
      scale.time, scale.torque, limits.velocity, limits.torque, limits.passive_torque,
      limits.brake_damping, limits.brake_seconds);
}

/// Prints the policy, the machine and the rate, and how the policy was changed for the machine.
void PrintDriver(const RunArguments& a, const LoadedPolicy& policy) {
  fmt::print("{} on {}, {} Hz, {}\n", Printable(policy.name), Printable(a.link), a.hz,
             NameOf(RobotOf(policy)));
  if (a.start != "hanging" && a.start != "upright") {
    fmt::print("  start    {}\n", StateText(ParsePendulumStart(a.start)));
  }
  const std::string change = ChangeOfSize(policy);
  if (!change.empty()) fmt::print("  {}\n", change);
  const double cycles = CyclesIn(policy.control_period(), std::llround(a.hz));
  constexpr double kRounding = 1e-6;
  if (std::abs(cycles - std::round(cycles)) > kRounding * cycles) {
    fmt::print(
        "  decides every {:.4g} s, which is {:.4g} cycles: at the cycle nearest to its end\n",
        policy.control_period(), cycles);
  }
}

/// The exit code of a run. Throws Failure if the supervisor ended it, or if the links are not
/// upright.
int ExitCodeOf(const Limits& limits, const Supervisor& supervisor, const LoopSummary& summary) {
  if (!supervisor.reason().empty()) throw Failure(supervisor.reason());
  if (StopSignal() != 0) return 128 + StopSignal();
  // Without torque the loop only reads.
  if (limits.torque > 0 && summary.upright == 0) {
    throw Failure("the links were not upright at the end of the run");
  }
  return 0;
}

int Drive(const RunArguments& a, const MachinePolicy& policy, const std::optional<Twin>& twin,
          const LinkAddress& address) {
  // A first call of another controller touches memory that is not there yet.
  ControllerOf(policy)(0, {});
  MachineController controller = ControllerOf(policy);
  const StateSource source = a.differences ? StateSource::kDifferences : StateSource::kTwin;
  const double period = 1 / a.hz;
  const Twin machine = KnownMachine(*policy, twin);
  const SizedSettings settings = SettingsFor(a, machine);
  Estimator estimator =
      twin ? Estimator(*twin, period, source) : Estimator(settings.sensors, period);
  Supervisor supervisor = SupervisorOf(a, settings, *policy, twin);
  const LoopConfig config{.hz = std::llround(a.hz),
                          .seconds = a.seconds,
                          .actuated_joint = static_cast<int>(RobotOf(*policy)),
                          .compensation = a.compensation,
                          .stop = [] { return StopSignal() != 0; }};
  OpenLink(a, twin, address);
  MachineLink& link = *g_link;
  LogWriter log(a.log);
  PrintDriver(a, *policy);
  PrintLimits(settings.limits, machine);
  if (!link.simulated()) {
    const std::string missing = EnterRealTime();
    if (!missing.empty()) fmt::print("  not permitted: {}; cycles may be late\n", missing);
  }
  std::fflush(stdout);
  GuardMotors([] { g_link->SwitchOffAtOnce(); });
  ControlLoop loop(config, link, estimator, supervisor, std::move(controller), log);
  loop.Run();
  log.Finish();
  PrintSummary(loop.summary(), link.counts(), supervisor, link.simulated());
  if (log.dropped() > 0) fmt::print("  log      {} rows left out\n", log.dropped());
  if (!a.log.empty()) fmt::print("written {}\n", Printable(a.log));
  return ExitCodeOf(settings.limits, supervisor, loop.summary());
}

/// Warns of a twin whose torques act before the cycle in which this loop sends them. The delay of a
/// twin counts from the reading of its own loop.
void WarnOfRate(const Twin& twin, double hz) {
  constexpr double kCycles = 1.5;
  if (-twin.actuator.delay <= kCycles / hz) return;
  fmt::print(stderr,
             "warning: torques of the twin act {:.3g} ms before this loop sends them. The loop of "
             "its logs has {:.4g} Hz: use --hz\n",
             -1e3 * twin.actuator.delay, 1 / twin.loop.period);
}

/// Says how the plant that a policy was made for differs from the twin. Throws BadInput if motors
/// of a machine would turn without consent.
void CompareWithTwin(const RunArguments& a, const LoadedPolicy& policy, const Twin& twin,
                     bool simulated) {
  const std::string other = DifferencesFromTwin(policy, twin);
  if (other.empty()) return;
  const bool drives = !simulated && SettingsFor(a, twin).limits.torque > 0;
  if (drives && !a.force) {
    throw BadInput(Concat(other, "; train one with --plant ", a.twin,
                          ", or give --force if this policy shall drive the machine"));
  }
  fmt::print(stderr, "warning: {}\n", other);
}

int RunRun(const RunArguments& a) {
  ParseRobot(a.robot);  // throws
  const LinkAddress address = ParseLink(a.link, /*listens=*/false);
  CheckBaud(address, std::llround(a.hz));
  if (IsStandardStream(a.log)) throw BadInput("--log: expected a file, got standard output");
  if (!a.log.empty()) CheckWritable("--log", a.log);
  const bool in_process = address.transport == LinkAddress::Transport::kTwin;
  std::optional<Twin> twin;
  if (in_process || !a.twin.empty())
    twin =
        a.twin.empty() ? ReadTwin(address.place, "--link", kLinkForms) : ReadTwin(a.twin, "--twin");
  if (twin) {
    WarnOfDistrust(twin->name, twin->distrust);
    WarnOfRate(*twin, a.hz);
  }
  if (in_process && !a.twin.empty()) {
    throw BadInput("--twin: expected a link by UDP or a serial line with it, got a twin as --link");
  }
  if (a.draw && (!in_process || twin->covariance.empty()))
    throw BadInput("--draw: expected a twin with [covariance] as --link, got none");
  if (!twin && a.compensation > 0)
    throw BadInput("--compensation: expected --twin with it, got none");
  const MachinePolicy policy = GetMachinePolicy(a.policy, a.robot, twin, std::llround(a.hz));
  (void)CyclesIn(policy->control_period(), std::llround(a.hz));  // throws
  if (twin) CompareWithTwin(a, *policy, *twin, in_process);
  return Drive(a, policy, twin, address);
}

}  // namespace

void AddRun(CommandLine& line) {
  RunArguments& a = line.Runs(RunRun);
  AddPolicy(line, a.policy);
  line.Require("policy");
  Options period;
  DescribeControlPeriod(period, &a.policy.control_period);
  line.Arguments(period);
  line.Text(
      "--link", a.link, "LINK",
      Concat("machine: udp:HOST:PORT, serial:DEVICE[:BAUD] (default 921600 bit/s), or the file "
             "of a twin or a shipped plant (",
             Join(NamesOf(EmbeddedPlants()), ", "), "), which is simulated"));
  line.Require("--link");
  line.Text("--twin", a.twin, "FILE",
            "twin of the machine at a UDP or serial link, for the estimate of its state");
  line.Text("--robot", a.robot, "ROBOT",
            "motor of a controller's design (pendubot, acrobot; default the policy's own)");
  line.Text("--log", a.log, "FILE",
            "new CSV file to write, a row per reading; `machine check` reads it");
  line.Text("--start", a.start, "STATE",
            "state in which the controller takes over, or q1,q2,w1,w2 in rad and rad/s or with "
            "units such as 180deg (hanging, upright; "
            "default hanging)");
  Options own;
  own.Section("loop");
  own.Add(&a.hz, "hz", {100, 1000}, "1/s", "cycles per second").step = 1;
  own.Add(&a.seconds, "seconds", {0.1, 86400}, "s", "time in which the controller drives");
  own.Add(&a.compensation, "compensation", kZeroToOne, "",
          "share of both joints' estimated dry friction that the motors compensate; needs a twin");
  line.Arguments(own);
  line.Settings(OptionsOf(SizedSettings()), a.sized);
  line.Check([&a] {
    SizedSettings scratch;
    SetFlags(OptionsOf(scratch), a.sized);
  });
  AddSeed(line, a.seed, "the twin's cycles and of --draw");
  line.Flag("--differences", a.differences,
            "estimate velocities by differences of the angles, without the twin's prediction");
  line.Flag("--draw", a.draw,
            "with a twin as --link: play a machine drawn from the twin's covariance");
  line.Flag("--force", a.force,
            "drive a machine at a UDP or serial link with a policy that was made for another plant "
            "than its twin");
  line.Excludes("--compensation", {"--differences"}, ", which estimates no friction");
  line.Notes(
      "The loop waits for readings (idle), then for the start state (armed). From hanging links,\n"
      "a pulse of the motor then has to move both joints (probing). Then the controller drives\n"
      "(running). Afterwards, at Ctrl-C and beyond a limit it brakes until\n"
      "the links hang; a second Ctrl-C switches the motors off at once. So does a fault: no\n"
      "reading for --max-age, a reading that is no number, an angle that jumps, an encoder that\n"
      "sticks or saturates (docs/howto/protection.md).\n"
      "Exit code: 0 if the links are upright at the end (with --max-torque 0: in any case), or 1\n"
      "with the reason in a line.\n\n"
      "A controller is designed for the twin without dry friction. --made-for changes this\n"
      "plant. A policy that was made for another plant than the twin (inertias, gravity, torque\n"
      "limit, decisions in the natural time) gets a warning, and drives a machine only with "
      "--force.\n"
      "Read docs/howto/real-machine.md before you switch on motors.\n");
  line.Examples(
      "  ./upswing run tvlqr --link twin.toml --compensation 0.95 --log rehearsal.csv\n"
      "  ./upswing fake twin.toml --link udp:4000        in another terminal\n"
      "  ./upswing run runs/twin --link udp:127.0.0.1:4000 --twin twin.toml\n"
      "  ./upswing run runs/twin --link serial:/dev/ttyACM0:921600 --twin twin.toml \\\n"
      "    --max-torque 2 --max-velocity 10 --seconds 5 --log first.csv\n"
      "  ./upswing machine check first.csv\n");
}

}  // namespace upswing::machine
