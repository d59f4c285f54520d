#include <fmt/format.h>

#include "agents/controllers.h"
#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "extras/view/frames.h"
#include "extras/view/view.h"
#include "os/streams.h"

#ifdef UPSWING_VIEWER
#include "extras/view/view_window.h"
#include "runs/find_policy.h"
#endif

namespace upswing {
namespace {

constexpr size_t kMostPolicies = 16;
constexpr double kForEver = 1e7;  // s, until the window closes or the recording ends

struct ViewArguments {
  std::vector<std::string> names;
  PolicyArguments controller;  // settings of the controllers
  TrialArguments trial;
  std::string record, csv;
  ViewLook look;
  double seconds = -1, fps = -1;  // negative: not given
  double speed = 1;
  int64_t width = 960, height = 640;
  bool headless = false;
};

/// The policies of the command line, in their order. Throws BadInput.
std::vector<LoadedPolicy> PoliciesOf(const ViewArguments& a) {
  if (a.names.size() > kMostPolicies) {
    throw BadInput(
        Concat("view: expected at most ", kMostPolicies, " policies, got ", a.names.size()));
  }
  return GetPolicies(a.names, a.controller);
}

/// One rollout per policy, in their order; `policies` must outlive them.
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
/// The plants that the window can switch to, without duplicates: the requested one, those of the
/// policies' trainings, and the default one.
std::vector<std::pair<std::string, Plant>> PlantsOf(const std::vector<RolloutConfig>& entries,
                                                    const std::vector<LoadedPolicy>& policies) {
  std::vector<std::pair<std::string, Plant>> plants;
  const auto add = [&](const std::string& name, const Plant& plant) {
    for (const auto& [_, other] : plants) {
      if (PlantValues(other) == PlantValues(plant)) return;
    }
    plants.emplace_back(name, plant);
  };
  add("as at the start", entries.front().env.plant(0));
  for (const LoadedPolicy& loaded : policies) {
    add(Concat(loaded.origin(), " of ", TitleOf(loaded)), loaded.plant);
  }
  add("the default", Plant());
  return plants;
}
#endif

/// Records a film or picture, and writes the CSV, without a window.
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
    throw BadInput(Concat("--csv: expected another file than --record, got ", a.csv));
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
      "view: this program was built without the window; ./upswing view builds it (by hand: cmake "
      "--preset release -DUPSWING_VIEWER=ON, with GLFW 3.3); --record FILE and --headless need no "
      "window");
#endif
}

/// Adds the policies to view, and the settings of the controllers among them.
void AddPolicies(CommandLine& line, ViewArguments& a) {
  AddControllers(line, a.controller);
  line.Texts(
      "policies", a.names, "POLICY|RUN...",
      Concat("policies, shown side by side: policy.safetensors, run folders or controllers (",
             Join(ControllerNames(), ", "), "); none: the motor is off"));
}

/// Adds the options of the picture.
void AddPicture(CommandLine& line, ViewArguments& a) {
  Options own;
  own.Add(&a.seconds, "seconds", {0, 1000}, "s",
          "length of the recording, or time until the window closes")
      .usual = "10; 20 with --episode; a window stays open";
  own.Add(&a.fps, "fps", {1, 200}, "", "frames per second of a recording").usual =
      "50; 25 for a GIF";
  own.Add(&a.speed, "speed", {0.01, 100}, "",
          "playback speed; 1: real time; 0.1: ten times slower");
  own.Add(&a.width, "width", {kLeastPixels, kMostPixels}, "pixels", "width of the picture");
  own.Add(&a.height, "height", {kLeastPixels, kMostPixels}, "pixels", "height of the picture");
  own.Add(&a.look.camera.azimuth, "azimuth", {-360, 360}, "deg",
          "azimuth of the camera; 90: perpendicular to the pendulum's plane");
  own.Add(&a.look.camera.elevation, "elevation", {-90, 90}, "deg", "elevation of the camera");
  own.Add(&a.look.camera.distance, "distance", {0, 1000}, "m",
          "distance of the camera; 0: far enough to show everything");
  own.Add(&a.look.text, "text", "show name, time and torque in the picture");
  own.Add(&a.look.marks, "marks", "show torque, goal and the tip's path in the picture");
  line.Arguments(own);
}

}  // namespace

void AddView(CommandLine& line) {
  ViewArguments& a = line.Runs(RunView);
  AddPolicies(line, a);
  line.Text("--record", a.record, "FILE",
            "recording to write instead of opening a window: FILE.mp4 or FILE.gif (needs ffmpeg), "
            "FILE.png (the last frame) or FOLDER/ (each frame as PNG)");
  line.Flag("--headless", a.headless, "open no window; needs --record or --csv");
  line.Text("--csv", a.csv, "FILE", "CSV file to write, as `simulate` does; -: standard output");
  AddPicture(line, a);
  AddEpisodeOptions(line, a.trial);
  AddTrialOptions(line, a.trial, "noise, random plants and the start of --episode");
  line.Footer(
      "Keys in the window:\n"
      "  space        pause                enter    turn the policy off or on\n"
      "  left, right  step                 tab      next policy\n"
      "  backspace    start again          P        next plant\n"
      "  - =          slower, faster       F1       show all keys\n"
      "A double click selects a link; ctrl-drag pulls it.\n\n"
      "Examples:\n"
      "  ./upswing view runs/d3qn-seed1\n"
      "  ./upswing view runs/d3qn-seed1 lqr --start 3.1,0,0,0\n"
      "  ./upswing view runs/d3qn-seed1 --set mass2=1.3 --delay 0.02\n"
      "  ./upswing view runs/d3qn-seed1 --record swing-up.mp4 --seconds 5 --speed 0.5\n"
      "  ./upswing view runs/d3qn-seed1 --record frames/    PNG files, without ffmpeg\n"
      "  ./upswing view --start 3,0,0,0                     no motor: it falls\n");
}

}  // namespace upswing
