#include "view/view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/format.h"
#include "core/text.h"
#include "io/frames.h"

namespace upswing {
namespace {

constexpr double kTrailSeconds = 1.2;
constexpr double kForEver = 1e7;  // s

/// Where the tip is: x, z over the pivot, m.
std::array<double, 2> TipOf(const Plant& plant, const PendulumState& s) {
  return {-plant.length1 * std::sin(s.q1) - plant.length2 * std::sin(s.q1 + s.q2),
          TipHeight(plant, s)};
}

/// The cubic through angles a, b with velocities va, vb at the ends of a control period, and its
/// derivative, at a share x of the period.
std::array<double, 2> Between(double a, double va, double b, double vb, double x) {
  const double h = kControlPeriod, y = x - 1;
  const double value =
      (1 + 2 * x) * y * y * a + x * y * y * h * va + x * x * (3 - 2 * x) * b + x * x * y * h * vb;
  const double slope =
      (6 * x * y * a + y * (3 * x - 1) * h * va - 6 * x * y * b + x * (3 * x - 2) * h * vb) / h;
  return {value, slope};
}

/// The lines below a picture; one alone where it is small.
std::vector<std::array<std::string, 2>> StatusOf(const ViewEpisode& episode, double steps,
                                                 bool small) {
  const PendulumState s = episode.StateAt(steps);
  const Plant plant = episode.plant();
  if (small) {
    return {{fmt::format("{:.2f} s", steps * kControlPeriod),
             fmt::format("{:+.2f} N m", episode.TorqueAt(steps) + 0.0)}};
  }
  return {
      {"time", fmt::format("{:6.2f} s", steps * kControlPeriod)},
      {"torque", fmt::format("{:+6.2f} N m", episode.TorqueAt(steps) + 0.0)},
      {"tip", fmt::format("{:+6.2f} m{}", TipHeight(plant, s), Inverted(s) ? "  upright" : "")}};
}

}  // namespace

ViewEpisode::ViewEpisode(ViewEntry entry) { Replace(std::move(entry)); }

void ViewEpisode::Replace(ViewEntry entry) {
  if (!HasPlant(entry.env.task)) {
    throw BadInput(Concat(entry.title, ": expected a policy of ", kDoublePendulum,
                          ", which alone can be viewed, got one of ", entry.env.task));
  }
  RolloutConfig config;
  config.policy = entry.policy;
  config.env = entry.env;
  config.start = entry.start;
  config.seconds = kForEver;
  episode_ = std::make_unique<Episode>(std::move(config));
  entry_ = std::move(entry);
  rows_.clear();
  inputs_.clear();
}

void ViewEpisode::Step(bool motor, const std::array<double, 2>& push) {
  constexpr std::array<double, 2> kNone{};
  const std::array<double, 2> before = inputs_.empty() ? kNone : inputs_.back().push;
  if (push != before) env().Push(0, push);
  rows_.push_back(episode_->Step(motor));
  inputs_.push_back({motor, push});
  if (episode_->terminated()) throw StateBlewUp(rows_.back());
}

void ViewEpisode::GoBack(int64_t steps) {
  std::vector<Input> inputs = inputs_;
  inputs.resize(static_cast<size_t>(std::clamp<int64_t>(steps, 0, this->steps())));
  Replace(entry_);
  for (const Input& input : inputs) Step(input.motor, input.push);
}

Rollout ViewEpisode::rollout() const {
  return {episode_->spec(), rows_, plant(), episode_->pendulum()->disturbance(0)};
}

PendulumState ViewEpisode::StateOfRow(int64_t k) const {
  return k < steps() ? StateOf(rows_[static_cast<size_t>(k)]) : episode_->pendulum()->state(0);
}

PendulumState ViewEpisode::StateAt(double steps) const {
  const auto k = static_cast<int64_t>(std::floor(steps));
  const double x = steps - static_cast<double>(k);
  const PendulumState a = StateOfRow(k);
  if (x <= 0) return a;
  const PendulumState b = StateOfRow(k + 1);
  const auto [q1, w1] = Between(a.q1, a.w1, b.q1, b.w1, x);
  const auto [q2, w2] = Between(a.q2, a.w2, b.q2, b.w2, x);
  return {q1, q2, w1, w2};
}

double ViewEpisode::TorqueAt(double steps) const {
  const auto k = std::min(static_cast<int64_t>(std::floor(steps)), this->steps() - 1);
  return k < 0 ? 0 : rows_[static_cast<size_t>(k)].torque;
}

View::View(const std::vector<ViewEntry>& entries, const ViewLook& look, PictureSize size)
    : look_(look) {
  for (const ViewEntry& entry : entries) {
    episodes_.emplace_back(entry);
    const Plant plant = episodes_.back().plant();
    reach_ = std::max(reach_, plant.length1 + plant.length2);
  }
  // All in rooms of the same size, so that they can be compared.
  for (const ViewEpisode& episode : episodes_) {
    scenes_.push_back(
        std::make_unique<PendulumScene>(episode.plant(), episode.entry().env.mjcf, reach_));
  }
  Show(-1, size);
}

void View::Show(int index, PictureSize size) {
  shown_ = index;
  const mjrRect place = PanelPlace(0, panels(), size.width, size.height);
  constexpr int kSmall = 400;  // pixels
  small_ = std::min(place.width, place.height) < kSmall;
  for (const auto& scene : scenes_) {
    scene->SetCamera(look_.camera, static_cast<double>(place.width) / place.height);
  }
}

void View::Replace(size_t index, ViewEntry entry) {
  ViewEpisode& episode = episodes_[index];
  episode.Replace(std::move(entry));
  auto scene = std::make_unique<PendulumScene>(episode.plant(), episode.entry().env.mjcf, reach_);
  scene->camera() = scenes_[index]->camera();
  scene->option() = scenes_[index]->option();
  std::ranges::copy(scenes_[index]->scene().flags, scene->scene().flags);
  scene->perturb() = scenes_[index]->perturb();
  scenes_[index] = std::move(scene);
}

std::span<const ScenePanel> View::At(double steps) {
  panels_.clear();
  for (size_t i = 0; i < episodes_.size(); ++i) {
    if (shown_ >= 0 && static_cast<int>(i) != shown_) continue;
    const ViewEpisode& episode = episodes_[i];
    const Plant plant = episode.plant();
    Marks marks;
    std::vector<std::array<double, 2>> trail;
    marks.goal = look_.marks;
    if (look_.marks) {
      marks.torque = episode.TorqueAt(steps);
      const double first = std::max(0.0, steps - kTrailSeconds / kControlPeriod);
      for (double k = std::floor(first); k < steps; k += 0.5) {
        trail.push_back(TipOf(plant, episode.StateAt(k)));
      }
      trail.push_back(TipOf(plant, episode.StateAt(steps)));
    }
    marks.trail = trail;
    scenes_[i]->Update(episode.StateAt(steps), marks);
    ScenePanel panel{scenes_[i].get(), "", {}};
    if (look_.text) {
      panel.title = episode.entry().title;
      panel.status = StatusOf(episode, steps, small_);
    }
    panels_.push_back(std::move(panel));
  }
  return panels_;
}

double UsualFps(const std::string& path) {
  return RecordingKindOf("", path) == RecordingKind::kGif ? 25 : 50;
}

int64_t Record(View& view, const RecordConfig& config, const std::function<bool()>& stopped,
               const Progress& progress) {
  // Frame i shows the time i · speed / fps; a picture alone, the end.
  const bool alone = RecordingKindOf(config.flag, config.path) == RecordingKind::kPng;
  const double step = alone ? config.seconds : config.speed / config.fps;  // s
  const int64_t frames =
      alone ? 1 : static_cast<int64_t>(std::floor(config.seconds / step + 1e-9)) + 1;
  const FrameFormat format{config.size.width, config.size.height, config.fps, frames};
  Offscreen offscreen(config.size);
  const auto writer = MakeFrameWriter(config.flag, config.path, format);
  for (int64_t i = 0; i < frames; ++i) {
    const double seconds = alone ? config.seconds : static_cast<double>(i) * step;
    // Rounded, as a control step's own time must find its own row.
    const double steps = std::round(seconds / kControlPeriod * 1e6) / 1e6;
    for (ViewEpisode& episode : view.episodes()) {
      while (static_cast<double>(episode.steps()) <= steps) episode.Step();
    }
    writer->Write(offscreen.Render(view.At(steps)));
    if (stopped()) return 0;
    if (progress) progress(static_cast<double>(i + 1), static_cast<double>(frames));
  }
  writer->Finish();
  return frames;
}

}  // namespace upswing
