#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/signals.h"
#include "extras/machine/drive/fake_machine.h"
#include "extras/machine/drive/link.h"
#include "extras/machine/drive/real_time.h"
#include "extras/machine/drive/supervisor.h"
#include "pendulum/start_text.h"
#include "runs/plant_file.h"

namespace upswing::machine {
namespace {

struct FakeArguments {
  std::string twin, link, stuck, start = "hanging";
  FakeConfig config;
  int64_t seed = 1;
  bool draw = false, quiet = false;
};

/// Parses JOINT@SECONDS. Throws BadInput.
void ParseStuck(const std::string& text, MachineFaults& faults) {
  const std::vector<std::string_view> parts = Split(text, '@');
  if (parts.size() == 2) {
    const std::optional<int64_t> joint = ParseInteger(parts[0]);
    const std::optional<double> seconds = ParseNumber(parts[1]);
    const bool is_joint = joint == 1 || joint == 2;
    if (is_joint && seconds && *seconds >= 0) {
      faults.stuck_after[static_cast<size_t>(*joint - 1)] = *seconds;
      return;
    }
  }
  throw BadInput(
      Concat("--stuck: expected JOINT@SECONDS such as 2@3.5, got \"", Printable(text), "\""));
}

int RunFake(const FakeArguments& a) {
  FakeConfig config = a.config;
  if (!a.stuck.empty()) ParseStuck(a.stuck, config.machine);
  const auto seed = static_cast<uint64_t>(a.seed);
  Twin twin = ReadTwin(a.twin, "fake");
  WarnOfDistrust(twin.name, twin.distrust);
  if (a.draw) {
    Rng rng(seed, "loop: machine");
    twin = DrawTwin(twin, rng);
  }
  FakeMachine machine(twin, ParsePendulumStart(a.start), config);
  Channel channel = Channel::Listen(ParseLink(a.link, /*listens=*/true));
  EnterRealTime();  // as far as it is permitted: firmware answers at once
  InstallSignalHandlers("");
  fmt::print("listening on {}\n", channel.name());
  fmt::print("start {}\n", StateText(ParsePendulumStart(a.start)));
  std::fflush(stdout);
  const auto report = [&](double seconds) {
    if (a.quiet) return;
    const PendulumState& s = machine.state();
    const FakeCounts& counts = machine.counts();
    fmt::print(
        "{:6.0f} s  angles {:7.3f} {:7.3f} rad  torques {:6.3f} {:6.3f} N·m  {} commands, "
        "{} refused, {} watchdog\n",
        seconds, s.q1, s.q2, machine.torque()[0], machine.torque()[1], counts.commands,
        counts.refused, counts.watchdog);
    std::fflush(stdout);
  };
  Serve(
      channel, machine, config.line, seed, [] { return StopSignal() != 0; }, report);
  const FakeCounts& counts = machine.counts();
  fmt::print("{} commands, {} refused, {} watchdog\n", counts.commands, counts.refused,
             counts.watchdog);
  return 0;
}

}  // namespace

void AddFake(CommandLine& line) {
  FakeArguments& a = line.Runs(RunFake);
  line.Text("twin", a.twin, "TWIN",
            Concat("twin to play: a file or a shipped plant (",
                   Join(NamesOf(EmbeddedPlants()), ", "), ")"));
  line.Require("twin");
  line.Text("--link", a.link, "LINK",
            "udp:PORT on this computer (0: any free port), udp:HOST:PORT, or pty: a "
            "pseudo-terminal, whose path is printed");
  line.Require("--link");
  line.Text("--start", a.start, "STATE",
            "state at the beginning, or q1,q2,w1,w2 in rad and rad/s or with units such as 180deg "
            "(hanging, upright; default hanging)");
  line.Text("--stuck", a.stuck, "JOINT@SECONDS", "encoder that sticks from a time on");
  line.Arguments(OptionsOf(a.config));
  AddSeed(line, a.seed, "the line's faults and of --draw");
  line.Flag("--crossed", a.config.machine.crossed, "swap the encoders of the joints");
  line.Flag("--draw", a.draw, "play a machine drawn from the twin's covariance");
  line.Flag("--quiet", a.quiet, "print no line per second");
  line.Notes(
      "The machine answers each command with a reading (docs/reference/machine-link.md). It\n"
      "runs in real time until Ctrl-C. Times of faults count from the first command with\n"
      "motors on. UDP has no password: listen only on networks that you trust.\n");
  line.Examples(
      "  ./upswing fake twin.toml --link udp:4000\n"
      "  ./upswing fake twin.toml --link udp:4000 --loss 0.05 --delay 0.002 --jitter 0.001\n"
      "  ./upswing fake twin.toml --link pty --stuck 2@1.5\n");
}

}  // namespace upswing::machine
