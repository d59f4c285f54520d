#include "extras/view/view_window.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "base/error.h"
#include "base/text.h"
#include "extras/view/window.h"
#include "mujoco/engines.h"

namespace upswing {
namespace {

using Clock = std::chrono::steady_clock;
using Lines = std::vector<std::array<std::string, 2>>;

constexpr double kSlowest = 1.0 / 64, kFastest = 8;
constexpr double kMostLag = 0.1;           // most real time to catch up in one picture, s
constexpr double kPictureTime = 1.0 / 60;  // shortest time of a picture, s
constexpr int kChartPoints = 250;

/// The keys, listed by F1.
const Lines& Help() {
  static const Lines help{{"Space", "pause, continue"},
                          {"Right, Left arrow", "step forward, step back"},
                          {"Backspace", "start again"},
                          {"- and =", "slower, faster"},
                          {"Enter", "policy off, on"},
                          {"Tab", "show one policy, the next, all"},
                          {"1 to 9", "this policy takes over"},
                          {"P", "next plant"},
                          {"Drag", "turn the camera"},
                          {"Right drag", "move the camera"},
                          {"Scroll", "zoom"},
                          {"Double click", "select a link"},
                          {"Ctrl + right drag", "pull the link"},
                          {"Ctrl + drag", "twist the link"},
                          {"Esc", "reset the camera"},
                          {"F1, F2, F3", "help, information, chart"},
                          {"F4", "torque, goal and path"},
                          {"F5", "full screen"},
                          {"F6, F7", "frames, labels"},
                          {"W S T J I M", "wireframe, shadow, transparent, joints, inertia, mass"},
                          {"Ctrl + Q", "close"}};
  return help;
}

/// The running window: a clock, keys, and the state that they change.
class Session {
 public:
  explicit Session(const WindowConfig& config)
      : config_(config),
        view_(config.entries, config.look, config.size),
        window_("upswing view", config.size),
        speed_(config.speed),
        plant_rng_(config.seed, "view: plant", 0) {
    mjv_defaultFigure(&chart_);
    MakeChart();
  }

  Rollout Run() {
    view_.Show(-1, window_.size());
    Clock::time_point last = Clock::now();
    while (!window_.closed() && !closed_ && !config_.stopped()) {
      const Clock::time_point now = Clock::now();
      const double passed = std::chrono::duration<double>(now - last).count();
      last = now;
      for (const Key& key : window_.TakeEvents()) Press(key);
      if (!paused_) Advance(std::min(passed, kMostLag) * speed_ / kControlPeriod);
      Draw();
      // Limit the rate where drawing does not wait for the screen.
      std::this_thread::sleep_until(now + std::chrono::duration<double>(kPictureTime));
    }
    return view_.episodes().front().rollout();
  }

 private:
  static constexpr std::array<double, 2> kNoPush{};

  /// Whether the episode's physics supports pushes.
  static bool CanPush(const Episode& episode) { return episode.config().env.engine == &kMuJoCo; }

  /// Advances the shown time by `steps` control steps.
  void Advance(double steps) {
    double most = 1e18;
    if (config_.seconds >= 0) most = std::round(config_.seconds / kControlPeriod);
    shown_ = std::min(shown_ + steps, most);
    try {
      for (size_t i = 0; i < view_.episodes().size(); ++i) {
        Episode& episode = view_.episodes()[i];
        while (static_cast<double>(episode.steps()) < shown_) {
          episode.Step(motor_, CanPush(episode) ? view_.PullTorques(i) : kNoPush);
        }
      }
    } catch (const Error& error) {
      Notice(error.what());
      Restart();
      paused_ = true;
    }
    if (shown_ >= most) closed_ = true;
  }

  /// Jumps to the last computed step, where single steps begin.
  void Settle() { shown_ = static_cast<double>(view_.episodes().front().steps()); }

  void StepBack() {
    Settle();
    const auto steps = static_cast<int64_t>(std::max(0.0, shown_ - 1));
    for (Episode& episode : view_.episodes()) episode.GoBack(steps);
    Settle();
  }

  void Restart() {
    for (size_t i = 0; i < config_.entries.size(); ++i) {
      RolloutConfig entry = view_.episodes()[i].config();
      entry.start = config_.entries[i].start;
      view_.Replace(i, std::move(entry));
    }
    shown_ = 0;
  }

  /// Continues from the present states with changed entries.
  template <typename Change>
  void ChangeEntries(const Change& change) {
    Settle();
    for (size_t i = 0; i < view_.episodes().size(); ++i) {
      Episode& episode = view_.episodes()[i];
      RolloutConfig entry = episode.config();
      entry.start = episode.StateAt(static_cast<double>(episode.steps()));
      change(entry, static_cast<int>(i));
      view_.Replace(i, std::move(entry));
    }
    shown_ = 0;
  }

  /// Uses the policy of another entry on this entry's plant.
  void TakeOver(size_t number) {
    if (number >= config_.entries.size()) return;
    ChangeEntries([&](RolloutConfig& entry, int i) {
      if (view_.shown() >= 0 && i != view_.shown()) return;
      const RolloutConfig& other = config_.entries[number];
      entry.title = other.title;
      entry.policy = other.policy;
      entry.env.memory = other.env.memory;
      entry.env.assumed_plant = other.env.assumed_plant;
      entry.env.identified_from = other.env.identified_from;
    });
    Notice(Concat("policy: ", config_.entries[number].title));
  }

  /// Switches to the next plant of the list; after the last one, to a random plant within ±25%.
  void NextPlant() {
    plant_ = (plant_ + 1) % (config_.plants.size() + 1);
    Plant plant;
    std::string name = "random";
    if (plant_ < config_.plants.size()) {
      name = config_.plants[plant_].first;
      plant = config_.plants[plant_].second;
    } else {
      Randomization random;
      random.plant.fill(0.25);
      plant = random.Draw(config_.plants.front().second, plant_rng_);
    }
    ChangeEntries([&](RolloutConfig& entry, int) {
      entry.env.plants = {plant};
      entry.env.randomization = Randomization();
    });
    Notice(Concat("plant: ", name));
  }

  void Press(const Key& key) {
    switch (key.code) {
      case 'Q':
        closed_ = closed_ || key.control;
        break;
      case Key::kSpace:
        paused_ = !paused_;
        break;
      case Key::kRight:
        paused_ = true;
        Settle();
        Advance(1);
        break;
      case Key::kLeft:
        paused_ = true;
        StepBack();
        break;
      case Key::kBackspace:
        Restart();
        break;
      case '-':
        speed_ = std::max(kSlowest, speed_ / 2);
        break;
      case '=':
        speed_ = std::min(kFastest, speed_ * 2);
        break;
      case Key::kEnter:
        motor_ = !motor_;
        break;
      case Key::kTab:
        ShowNext(key.shift ? -1 : 1);
        break;
      case 'P':
        NextPlant();
        break;
      case Key::kEscape:
        view_.Show(view_.shown(), window_.size());
        break;
      case Key::kF4:
        view_.look().marks = !view_.look().marks;
        break;
      case Key::kF5:
        window_.ToggleFullScreen();
        break;
      default:
        if (key.code >= '1' && key.code <= '9') {
          TakeOver(static_cast<size_t>(key.code - '1'));
        } else {
          Toggle(key.code);
        }
    }
  }

  /// Shows the next single episode; after the last one, all of them.
  void ShowNext(int direction) {
    const auto count = static_cast<int>(view_.episodes().size());
    if (count == 1) return;
    const int next = (view_.shown() + 1 + direction + count + 1) % (count + 1) - 1;
    view_.Show(next, window_.size());
  }

  /// Toggles an overlay or one of MuJoCo's drawing options.
  void Toggle(int code) {
    if (code >= Key::kF1 && code <= Key::kF3) {
      bool& overlay = overlays_.at(static_cast<size_t>(code - Key::kF1));
      overlay = !overlay;
    }
    const auto flip = [](mjtByte& flag) { flag = flag == 0 ? 1 : 0; };
    for (const auto& scene : view_.scenes()) {
      mjvOption& option = scene->option();
      mjtByte* rendering = scene->scene().flags;
      if (code == Key::kF6) option.frame = (option.frame + 1) % mjNFRAME;
      if (code == Key::kF7) option.label = (option.label + 1) % mjNLABEL;
      if (code == 'W') flip(rendering[mjRND_WIREFRAME]);
      if (code == 'S') flip(rendering[mjRND_SHADOW]);
      if (code == 'T') flip(option.flags[mjVIS_TRANSPARENT]);
      if (code == 'J') flip(option.flags[mjVIS_JOINT]);
      if (code == 'I') flip(option.flags[mjVIS_INERTIA]);
      if (code == 'M') flip(option.flags[mjVIS_COM]);
    }
  }

  /// Shows a short message for a while.
  void Notice(const std::string& text) {
    notice_ = text;
    notice_end_ = Clock::now() + std::chrono::seconds(3);
  }

  void Draw() {
    view_.look().text = config_.look.text && !overlays_[0];  // help uses the same place
    const std::span<const ScenePanel> panels = view_.At(shown_);
    std::vector<Overlay> overlays;
    if (overlays_[0]) overlays.push_back({mjGRID_TOPLEFT, Help()});
    if (overlays_[1]) overlays.push_back({mjGRID_TOPRIGHT, Information()});
    if (Clock::now() < notice_end_) overlays.push_back({mjGRID_TOP, {{notice_, ""}}});
    if (overlays_[2]) FillChart();
    window_.Draw(panels, overlays, overlays_[2] ? &chart_ : nullptr);

    std::string title = "upswing view";
    if (view_.episodes().size() == 1 || view_.shown() >= 0) {
      title += Concat(" - ", view_.episodes()[Shown()].config().title);
    }
    title += fmt::format(" - {:.2f} s", std::round(shown_ * kControlPeriod * 100) / 100);
    if (speed_ != 1) title += fmt::format(" - speed {:g}", speed_);
    if (!motor_) title += " - policy off";
    if (paused_) title += " - paused";
    if (title != title_) window_.SetTitle(title);
    title_ = title;
  }

  size_t Shown() const { return view_.shown() < 0 ? 0 : static_cast<size_t>(view_.shown()); }

  /// The lines of F2 about the first shown episode.
  Lines Information() {
    const Episode& episode = view_.episodes()[Shown()];
    const PendulumState s = episode.StateAt(shown_);
    const Plant plant = episode.rollout().plant;
    Lines lines{
        {"Speed", fmt::format("{:g}", speed_)},
        {"Angles", fmt::format("{:+.3f} {:+.3f} rad", s.q1, s.q2)},
        {"Velocities", fmt::format("{:+.3f} {:+.3f} rad/s", s.w1, s.w2)},
        {"Energy", fmt::format("{:.2f} of {:.2f} J", Energy(plant, s), EnergyTarget(plant))}};
    double sum = 0;
    for (const RolloutRow& row : episode.rollout().rows) sum += row.reward;
    lines.push_back({"Return", fmt::format("{:.1f}", sum)});
    for (const auto& [name, value] : PlantValues(plant)) {
      lines.push_back({name, fmt::format("{:.4g}", value)});
    }
    const Options disturbance = OptionsOf(episode.rollout().disturbance);
    for (const Option& option : disturbance.all()) {
      if (option.implied && option.number() == 0) continue;
      lines.push_back({option.name, FormatNumber(option.number())});
    }
    return lines;
  }

  void MakeChart() {
    chart_.flg_extend = 1;
    chart_.flg_legend = 1;
    chart_.figurergba[3] = 0.6F;
    (void)fmt::format_to_n(chart_.title, sizeof(chart_.title) - 1, "torque (N m)");
    (void)fmt::format_to_n(chart_.xlabel, sizeof(chart_.xlabel) - 1, "time (s)");
    (void)fmt::format_to_n(chart_.xformat, sizeof(chart_.xformat) - 1, "%.0f");
    (void)fmt::format_to_n(chart_.yformat, sizeof(chart_.yformat) - 1, "%.0f");
    chart_.gridsize[0] = 6;
    chart_.gridsize[1] = 3;
  }

  /// Fills the chart with the last seconds of all shown torques.
  void FillChart() {
    const auto last = static_cast<int64_t>(std::floor(shown_));
    const int64_t first = std::max<int64_t>(0, last - kChartPoints);
    chart_.range[0][0] = static_cast<float>(static_cast<double>(first) * kControlPeriod);
    chart_.range[0][1] =
        static_cast<float>(static_cast<double>(first + kChartPoints) * kControlPeriod);
    int line = 0;
    for (size_t i = 0; i < view_.episodes().size(); ++i) {
      const Episode& episode = view_.episodes()[i];
      chart_.linepnt[i] = 0;
      if (view_.shown() >= 0 && static_cast<int>(i) != view_.shown()) continue;
      const double limit = episode.rollout().plant.torque_limit;
      chart_.range[1][0] = static_cast<float>(-limit);
      chart_.range[1][1] = static_cast<float>(limit);
      std::string name = episode.config().title.substr(0, sizeof(chart_.linename[0]) - 1);
      std::ranges::replace_if(
          name, [](char c) { return c < 0x20 || c > 0x7E; }, '?');
      *fmt::format_to_n(chart_.linename[line], sizeof(chart_.linename[0]) - 1, "{}", name).out = 0;
      int count = 0;
      for (int64_t k = first; k < std::min(last, episode.steps()); ++k) {
        const RolloutRow& row = episode.rollout().rows[static_cast<size_t>(k)];
        chart_.linedata[line][2 * count] = static_cast<float>(row.t);
        chart_.linedata[line][2 * count + 1] = static_cast<float>(row.torque);
        ++count;
      }
      chart_.linepnt[line++] = count;
    }
  }

  const WindowConfig& config_;
  View view_;
  Window window_;
  double speed_;
  Rng plant_rng_;
  double shown_ = 0;  // control steps from the start, with a fraction
  bool paused_ = false, motor_ = true, closed_ = false;
  size_t plant_ = 0;
  std::array<bool, 3> overlays_{};  // F1 to F3
  std::string title_, notice_;
  Clock::time_point notice_end_{};
  mjvFigure chart_;
};

}  // namespace

Rollout ShowWindow(const WindowConfig& config) {
  // On the heap, because MuJoCo's chart is large.
  return std::make_unique<Session>(config)->Run();
}

}  // namespace upswing
