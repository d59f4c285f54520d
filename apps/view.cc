#include "view/view.h"

#include <fmt/format.h>

#include "apps/commands.h"
#include "apps/progress.h"
#include "apps/signals.h"
#include "core/error.h"
#include "core/format.h"
#include "core/text.h"
#include "io/frames.h"
#include "io/streams.h"
#include "setup/controllers.h"

#ifdef UPSWING_VIEWER
#include "run/find_policy.h"
#include "view/view_window.h"
#endif

namespace upswing {
namespace {

constexpr size_t kMostPolicies = 16;
constexpr double kForEver = 1e7;  // s, until the window closes or the recording ends

struct ViewArguments {
  std::vector<std::string> names;
  PolicyArguments controller;  // settings of those that are controllers
  TrialArguments trial;
  std::string record, csv;
  ViewLook look;
  double seconds = -1, fps = -1;  // negative: not given
  double speed = 1;
  int64_t width = 960, height = 640;
  bool headless = false;
};

/// The policies that were named, in their order. Throws BadInput.
std::vector<LoadedPolicy> PoliciesOf(const ViewArguments& a) {
  if (a.names.size() > kMostPolicies) {
    throw BadInput(
        Concat("view: expected at most ", kMostPolicies, " policies, got ", a.names.size()));
  }
  std::vector<LoadedPolicy> policies = GetPolicies(a.names, a.controller);
  for (const LoadedPolicy& loaded : policies) {
    if (HasPlant(loaded.task)) continue;
    throw BadInput(Concat(loaded.name, ": expected a policy of ", kDoublePendulum,
                          ", which alone can be viewed, got one of ", loaded.task));
  }
  return policies;
}

/// What is shown, in its order; `policies` must outlive it.
std::vector<RolloutConfig> EntriesOf(const ViewArguments& a,
                                     const std::vector<LoadedPolicy>& policies) {
  std::vector<RolloutConfig> entries;
  const auto add = [&](const LoadedPolicy* loaded, const std::string& title) {
    RolloutConfig& entry = entries.emplace_back(TrialEpisode(a.trial, loaded));
    entry.title = title;
    entry.seconds = kForEver;
  };
  const std::vector<std::string> titles = TitlesOf(policies);
  for (size_t i = 0; i < policies.size(); ++i) add(&policies[i], titles[i]);
  if (policies.empty()) add(nullptr, "no policy");
  return entries;
}

#ifdef UPSWING_VIEWER
/// The plants to switch to: the one that was asked for, those of the policies' trainings, and the
/// usual one; each once.
std::vector<std::pair<std::string, Plant>> PlantsOf(const std::vector<RolloutConfig>& entries,
                                                    const std::vector<LoadedPolicy>& policies) {
  std::vector<std::pair<std::string, Plant>> plants;
  const auto add = [&](const std::string& name, const Plant& plant) {
    for (const auto& [_, other] : plants) {
      if (PlantValues(other) == PlantValues(plant)) return;
    }
    plants.emplace_back(name, plant);
  };
  add("as at the beginning", entries.front().env.plant(0));
  for (const LoadedPolicy& loaded : policies) {
    add(Concat(loaded.origin(), " of ", TitleOf(loaded)), loaded.plant);
  }
  add("the usual one", Plant());
  return plants;
}
#endif

/// Without a window.
int RunHeadless(const ViewArguments& a, const std::vector<RolloutConfig>& entries, PictureSize size,
                double seconds) {
  InstallSignalHandlers("");
  if (!a.record.empty()) {
    View view(entries, a.look, size);
    const RecordConfig config{a.record, seconds, a.fps, a.speed, size};
    ProgressLine progress;
    const bool quiet = IsStandardStream(a.csv);
    const int64_t frames = Record(
        view, config, [] { return StopSignal() != 0; },
        [&](double done, double total) {
          if (quiet || !progress.due()) return;
          progress.Show(done / total, {fmt::format("picture {} of {}", done, total)});
        });
    progress.Clear();
    if (frames == 0) return 128 + StopSignal();
    if (!quiet) {
      fmt::print("{}: {} of {}x{}\n", Printable(a.record), Counted(frames, "picture"), a.width,
                 a.height);
    }
  }
  if (a.csv.empty()) return 0;
  RolloutConfig episode = entries.front();
  episode.seconds = seconds;
  WriteOutput(a.csv, RolloutCsv(RunRollout(episode)));
  return 0;
}

int RunView(const ViewArguments& a) {
  const bool headless = a.headless || !a.record.empty();
  if (!a.record.empty()) (void)RecordingKindOf("--record", a.record);
  if (a.headless && a.record.empty() && a.csv.empty()) {
    throw BadInput("--headless: expected --record FILE or --csv FILE to write, got none");
  }
  if (!a.csv.empty() && a.names.size() > 1) {
    throw BadInput(Concat("--csv: expected one policy, got ", a.names.size()));
  }
  if (!a.csv.empty() && a.csv == a.record) {
    throw BadInput(Concat("--csv: expected another file than that of --record, got ", a.csv));
  }
  if (!a.csv.empty()) CheckWritable("--csv", a.csv);
  const std::vector<LoadedPolicy> policies = PoliciesOf(a);
  const std::vector<RolloutConfig> entries = EntriesOf(a, policies);
  const PictureSize size{static_cast<int>(a.width), static_cast<int>(a.height)};
  const double usual = a.trial.is_of_eval() ? kEvaluationSeconds : 10;
  if (headless) return RunHeadless(a, entries, size, a.seconds < 0 ? usual : a.seconds);
#ifdef UPSWING_VIEWER
  InstallSignalHandlers("");
  const WindowConfig config{entries,
                            PlantsOf(entries, policies),
                            a.look,
                            size,
                            a.speed,
                            a.seconds,
                            static_cast<uint64_t>(a.trial.seed),
                            [] { return StopSignal() != 0; }};
  const Rollout seen = ShowWindow(config);
  if (!a.csv.empty()) WriteOutput(a.csv, RolloutCsv(seen));
  return StopSignal() == 0 ? 0 : 128 + StopSignal();
#else
  throw Failure(
      "view: this program was built without the window: ./upswing view builds it (by hand: cmake "
      "--preset release -DUPSWING_VIEWER=ON, with GLFW 3.3); --record FILE and --headless need "
      "none");
#endif
}

/// Adds the policies to look at, and the settings of the controllers among them.
void AddPolicies(CommandLine& line, ViewArguments& a) {
  AddControllers(line, a.controller);
  line.Texts("policies", a.names, "POLICY|RUN...",
             Concat("policy.safetensors, run folder or controller (", Join(ControllerNames(), ", "),
                    "), several side by side; none: nothing turns the motor"));
}

/// Adds what a picture is like.
void AddPicture(CommandLine& line, ViewArguments& a) {
  Options own;
  own.Add(&a.seconds, "seconds", {0, 1000}, "s", "how long a recording is, or a window is open")
      .usual = "10, with --episode 20; a window: until it is closed";
  own.Add(&a.fps, "fps", {1, 200}, "", "frames a second of a recording").usual = "50; of a GIF 25";
  own.Add(&a.speed, "speed", {0.01, 100}, "", "1: real time; 0.1: ten times slower");
  own.Add(&a.width, "width", {kLeastPixels, kMostPixels}, "", "of the picture, pixels");
  own.Add(&a.height, "height", {kLeastPixels, kMostPixels}, "", "of the picture, pixels");
  own.Add(&a.look.camera.azimuth, "azimuth", {-360, 360}, "deg",
          "of the camera; 90: across the pendulum's plane");
  own.Add(&a.look.camera.elevation, "elevation", {-90, 90}, "deg", "of the camera");
  own.Add(&a.look.camera.distance, "distance", {0, 1000}, "m",
          "of the camera; 0: as far as shows all");
  own.Add(&a.look.text, "text", "name, time and torque in the picture");
  own.Add(&a.look.marks, "marks", "torque, goal and the tip's path in the picture");
  line.Arguments(own);
}

}  // namespace

void AddView(CommandLine& line) {
  ViewArguments& a = line.Runs(RunView);
  AddPolicies(line, a);
  line.Text("--record", a.record, "FILE",
            "write FILE.mp4 or FILE.gif (with the program ffmpeg), FILE.png (the last moment) "
            "or FOLDER/ (each frame as PNG) instead of opening a window");
  line.Flag("--headless", a.headless, "open no window, as --record does");
  line.Text("--csv", a.csv, "FILE", "write the episode as `simulate` does; -: standard output");
  AddPicture(line, a);
  AddEpisodeOptions(line, a.trial);
  AddTrialOptions(line, a.trial, "noise, random plants and the start of --episode");
  line.Footer(
      "In the window: space pauses, right and left arrow step, backspace begins again, enter "
      "turns\n"
      "the policy off and on, tab changes the policy, P the plant, - and = the speed; double "
      "click\n"
      "selects a link and ctrl-drag pulls at it; F1 shows all keys.\n\n"
      "Examples:\n"
      "  ./upswing view runs/d3qn-seed1\n"
      "  ./upswing view runs/d3qn-seed1 lqr --start 3.1,0,0,0     side by side\n"
      "  ./upswing view runs/d3qn-seed1 --set mass2=1.3 --delay 0.02\n"
      "  ./upswing view runs/d3qn-seed1 --record swing-up.mp4 --seconds 5 --speed 0.5\n"
      "  ./upswing view runs/d3qn-seed1 --record frames/          PNG files, no ffmpeg\n"
      "  ./upswing view --start 3,0,0,0                           let it fall\n");
}

}  // namespace upswing
