#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "cli/python_child.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "judge/rollout.h"
#include "mujoco/engines.h"
#include "os/file.h"
#include "os/streams.h"
#include "pendulum/observation.h"
#include "pendulum/start_text.h"

namespace upswing {

/// The program in Python that draws: the text of python/upswing/_view.py.
const char* ViewProgram();

namespace {

namespace fs = std::filesystem;

constexpr size_t kMostPolicies = 8;
constexpr double kForEver = 1e7;  // s, until the window closes or the recording ends

struct ViewArguments {
  std::vector<std::string> names;
  PolicyArguments controller;  // settings of the controllers
  TrialArguments trial;
  std::string record, size = "960x640";
  double seconds = -1, fps = -1;  // negative: not given
  double speed = 1;
};

/// The kind of a recording: mp4, gif, png or folder. Throws BadInput.
std::string KindOf(const std::string& path) {
  if (path.ends_with('/')) return "folder";
  std::string ending = fs::path(path).extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; });
  if (ending == ".mp4" || ending == ".gif" || ending == ".png") return ending.substr(1);
  throw BadInput(
      Concat("--record: expected FILE.mp4, FILE.gif, FILE.png or FOLDER/, got \"", path, "\""));
}

/// The first bytes of files of a kind that KindOf names.
std::vector<std::string> BeginningsOf(const std::string& kind) {
  if (kind == "png") return {"\x89PNG"};
  if (kind == "gif") return {"GIF8"};
  // An MP4 file starts with the length of its first box, whose name is ftyp (ISO/IEC 14496-12).
  std::vector<std::string> lengths;
  for (const char length : {'\x14', '\x18', '\x1c', '\x20', '\x24'}) {
    lengths.push_back(std::string(3, '\0') + length + "ftyp");
  }
  return lengths;
}

/// The recording under construction. Throws BadInput if it cannot have this name.
std::unique_ptr<Making> MakeRecording(const std::string& path) {
  const std::string kind = KindOf(path);
  if (kind == "folder") {
    const fs::path folder = fs::path(path).parent_path();  // without the trailing slash
    CheckFree(folder, "choose another --record");
    return std::make_unique<Making>(folder, Making::Kind::kFolder);
  }
  CheckReplaceable("--record", path, Concat(kind, " file"), BeginningsOf(kind));
  const fs::path file = fs::exists(path) ? fs::canonical(path) : fs::path(path);  // of a link
  if (fs::exists(file) && !fs::is_regular_file(file)) {
    throw BadInput(Concat("--record ", path, ": expected a regular file"));
  }
  return std::make_unique<Making>(file, Making::Kind::kFile);
}

/// Sets width and height [pixels]. Throws BadInput.
void SetSize(const std::string& text, nlohmann::json& job) {
  const std::vector<std::string_view> sides = Split(text, 'x');
  for (size_t i = 0; i < 2; ++i) {
    const auto side = sides.size() == 2 ? ParseInteger(sides[i]) : std::nullopt;
    if (!side || *side < 16 || *side > 8192) {
      throw BadInput(
          Concat("--size: expected WIDTHxHEIGHT, each 16 to 8192 pixels, such as 960x640, got \"",
                 Printable(text), "\""));
    }
    job[i == 0 ? "width" : "height"] = *side;
  }
}

/// Episodes that the drawing program goes through.
class Show {
 public:
  /// One episode per policy, in their order; `policies` must outlive them.
  Show(const ViewArguments& a, const std::vector<LoadedPolicy>& policies)
      : recording_(!a.record.empty()) {
    const auto add = [&](const LoadedPolicy* loaded) {
      RolloutConfig config = TrialEpisode(a.trial, loaded);
      config.title = loaded != nullptr ? ShortTitle(*loaded) : "no policy";
      config.seconds = kForEver;
      episodes_.emplace_back(std::move(config));
    };
    for (const LoadedPolicy& loaded : policies) add(&loaded);
    if (policies.empty()) add(nullptr);
    for (const Episode& episode : episodes_) {
      if (episode.config().env.control_period == period()) continue;
      throw BadInput(Concat(Printable(episode.config().title), ": expected the control period of ",
                            Printable(episodes_.front().config().title), ", ",
                            FormatNumber(period()), " s, got ",
                            FormatNumber(episode.config().env.control_period)));
    }
  }

  /// Adds names, plants and goals.
  void Describe(nlohmann::json& job) const {
    for (const Episode& episode : episodes_) {
      job["names"].push_back(Printable(episode.config().title));
      nlohmann::json& plant = job["plants"].emplace_back();
      for (const auto& [name, value] : PlantValues(episode.rollout().plant)) plant[name] = value;
      job["goals"].push_back(GoalInputs(episode.rollout().goal.value_or(Pose())));
    }
  }

  /// Answers a request: a time [control steps], and the torques of the mouse about all joints
  /// [N·m] from there on; time 0 starts again. The answer is the time, then q1, q2, w1, w2 and the
  /// motor's torque of each episode.
  std::string Answer(const std::string& request) {
    std::vector<double> numbers;
    for (const std::string_view word : Split(request, ' ')) {
      numbers.push_back(ParseNumber(word).value_or(0));
    }
    steps_ = numbers.front();
    numbers.resize(1 + 2 * episodes_.size());
    if (steps_ <= 0) Restart();
    try {
      for (size_t i = 0; i < episodes_.size(); ++i) {
        Advance(episodes_[i], steps_, {numbers[1 + 2 * i], numbers[2 + 2 * i]});
      }
    } catch (const Error& error) {
      if (recording_) throw;
      SayError(OneLine(error.what()));
      Restart();
      steps_ = 0;
      for (Episode& episode : episodes_) Advance(episode, 0, {});
    }
    std::string answer = FormatNumber(steps_);
    for (const Episode& episode : episodes_) {
      const PendulumState s = episode.StateAt(steps_);
      for (const double number : {s.q1, s.q2, s.w1, s.w2, episode.TorqueAt(steps_)}) {
        answer += ' ' + FormatNumber(number);
      }
    }
    return answer;
  }

  /// The time of the last answer [control steps].
  double steps() const { return steps_; }
  /// The control period of all episodes, s.
  double period() const { return episodes_.front().config().env.control_period; }

 private:
  void Restart() {
    for (Episode& episode : episodes_) episode = Episode(episode.config());
  }

  /// Computes an episode up to a time, and the torque that acts then.
  static void Advance(Episode& episode, double steps, std::array<double, 2> push) {
    if (episode.config().env.engine != &kMuJoCo) push = {};  // cannot be pushed
    while (static_cast<double>(episode.steps()) <= steps) episode.Step(push);
  }

  std::vector<Episode> episodes_;
  double steps_ = 0;
  bool recording_;
};

/// Adds what a recording consists of. Frame i shows the time (i · speed / fps); a single picture
/// the end.
void DescribeRecording(const ViewArguments& a, const fs::path& path, double period,
                       nlohmann::json& job) {
  const std::string kind = KindOf(a.record);
  const double usual = a.trial.is_of_eval() ? kEvaluationSeconds : 10;
  const double seconds = a.seconds < 0 ? usual : a.seconds;
  double fps = kind == "gif" ? 25 : 50;
  if (a.fps > 0) fps = a.fps;
  const bool single = kind == "png";
  job["kind"] = kind;
  job["path"] = path;
  job["fps"] = fps;
  job["first"] = single ? seconds / period : 0;
  job["stride"] = a.speed / fps / period;
  job["frames"] = single ? 1 : static_cast<int64_t>(seconds * fps / a.speed + 1e-9) + 1;
}

int RunView(const ViewArguments& a) {
  nlohmann::json job;
  SetSize(a.size, job);
  if (!a.record.empty()) (void)KindOf(a.record);
  if (a.names.size() > kMostPolicies) {
    throw BadInput(
        Concat("view: expected at most ", kMostPolicies, " policies, got ", a.names.size()));
  }
  const std::vector<LoadedPolicy> policies = GetPoliciesIn(a.trial, a.names, a.controller);
  Show show(a, policies);
  show.Describe(job);
  std::unique_ptr<Making> making;
  if (a.record.empty()) {
    job["speed"] = a.speed;
    job["end"] = a.seconds < 0 ? nlohmann::json() : nlohmann::json(a.seconds / show.period());
  } else {
    making = MakeRecording(a.record);
    DescribeRecording(a, making->path(), show.period(), job);
  }

  if (!a.trial.start.empty()) {
    fmt::print("start {}\n", StateText(ParseState(a.trial.start, "--start")));
    std::fflush(stdout);
  }
  InstallSignalHandlers("");
  PythonChild drawer("view", ViewProgram(),
                     job.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  std::optional<EpisodeProgress> progress;  // of the pictures; a GIF goes through them twice
  while (const auto request = drawer.Next()) {
    drawer.Answer(show.Answer(*request));
    if (!making || job["frames"] == 1) continue;
    if (show.steps() <= 0) progress.emplace(false, "pictures");
    if (progress && show.steps() > 0)
      (*progress)(show.steps() / job["stride"].get<double>(), job["frames"]);
  }
  progress.reset();
  const int code = drawer.Finish();
  if (StopSignal() != 0) return 128 + StopSignal();
  if (code != 0 || !making) return code;
  if (fs::is_empty(making->path())) {
    throw Failure("view: Python drew nothing: expected UPSWING_PYTHON to name a Python");
  }
  making->Publish();
  fmt::print("{}: {} of {}x{}\n", Printable(a.record),
             Counted(job["frames"].get<int64_t>(), "picture"), job["width"].get<int>(),
             job["height"].get<int>());
  return 0;
}

/// Adds the options of window and recording.
void AddPicture(CommandLine& line, ViewArguments& a) {
  line.Text(
      "--record", a.record, "FILE",
      "recording to write instead of opening a window: FILE.mp4, FILE.gif, FILE.png (the last "
      "frame) or FOLDER/ (each frame as PNG)");
  Options own;
  own.Add(&a.seconds, "seconds", {0, 1000}, "s",
          "length of the recording, or time until the window closes")
      .usual = "10; 20 with --episode; a window stays open";
  own.Add(&a.speed, "speed", {0.01, 100}, "",
          "playback speed; 1: real time; 0.1: ten times slower");
  own.Add(&a.fps, "fps", {1, 200}, "", "frames per second of a recording").usual =
      "50; 25 for a GIF";
  line.Arguments(own);
  line.Text("--size", a.size, "WIDTHxHEIGHT", "size of a recording [pixels] (default 960x640)");
}

}  // namespace

void AddView(CommandLine& line) {
  ViewArguments& a = line.Runs(RunView);
  AddControllers(line, a.controller);
  line.Texts("policies", a.names, "POLICY|RUN",
             Concat("policies, shown side by side: ", PolicyWords(), "; none: the motor is off"));
  AddPicture(line, a);
  AddEpisodeOptions(line, a.trial);
  AddTrialOptions(line, a.trial, "noise, random plants and the start of --episode");
  line.Notes(
      "Keys in the window:\n"
      "  space        pause                backspace  start again\n"
      "  right        one control step     - =        slower, faster\n"
      "  F1           MuJoCo's own keys    tab        MuJoCo's settings\n"
      "A double click selects a link; ctrl and the right mouse button pull it.\n\n"
      "Python draws, with MuJoCo's viewer: `python3`, or the one that UPSWING_PYTHON names.\n");
  line.Examples(
      "  ./upswing view runs/d3qn-seed1\n"
      "  ./upswing view runs/d3qn-seed1 lqr --start 178deg,0,0,0\n"
      "  ./upswing view runs/d3qn-seed1 --set mass2=1.3 --delay 0.02\n"
      "  ./upswing view runs/d3qn-seed1 --record swing-up.mp4 --seconds 5 --speed 0.5\n"
      "  ./upswing view --start 170deg,0,0,0                no motor: it falls\n");
}

}  // namespace upswing
