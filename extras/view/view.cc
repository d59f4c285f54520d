#include "extras/view/view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "extras/view/frames.h"

namespace upswing {
namespace {

constexpr double kTrailSeconds = 1.2;

/// Position of the tip: x, z relative to the pivot, m.
std::array<double, 2> TipOf(const Plant& plant, const PendulumState& s) {
  return {-plant.length1 * std::sin(s.q1) - plant.length2 * std::sin(s.q1 + s.q2),
          TipHeight(plant, s)};
}

/// The status lines at the bottom of a picture; a single line if the picture is small.
std::vector<std::array<std::string, 2>> StatusOf(const Episode& episode, double steps, bool small) {
  const PendulumState s = episode.StateAt(steps);
  const Plant plant = episode.rollout().plant;
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

View::View(const std::vector<RolloutConfig>& entries, const ViewLook& look, PictureSize size)
    : look_(look) {
  for (const RolloutConfig& entry : entries) {
    episodes_.emplace_back(entry);
    const Plant plant = episodes_.back().rollout().plant;
    reach_ = std::max(reach_, plant.length1 + plant.length2);
  }
  // Rooms have the same size, so that pendulums can be compared.
  for (const Episode& episode : episodes_) {
    scenes_.push_back(std::make_unique<PendulumScene>(episode.rollout().plant,
                                                      episode.config().env.mjcf, reach_));
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

void View::Replace(size_t index, RolloutConfig entry) {
  Episode& episode = episodes_[index];
  episode = Episode(std::move(entry));
  auto scene =
      std::make_unique<PendulumScene>(episode.rollout().plant, episode.config().env.mjcf, reach_);
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
    const Episode& episode = episodes_[i];
    const Plant plant = episode.rollout().plant;
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
      panel.title = episode.config().title;
      panel.status = StatusOf(episode, steps, small_);
    }
    panels_.push_back(std::move(panel));
  }
  return panels_;
}

int64_t Record(View& view, const RecordConfig& config, const std::function<bool()>& stopped,
               const Progress& progress) {
  // Frame i shows the time i · speed / fps; a single picture shows the end.
  const RecordingKind kind = RecordingKindOf("--record", config.path);
  const bool alone = kind == RecordingKind::kPng;
  const double fps = config.fps > 0 ? config.fps : kind == RecordingKind::kGif ? 25 : 50;
  const double step = alone ? config.seconds : config.speed / fps;  // s
  const int64_t frames =
      alone ? 1 : static_cast<int64_t>(std::floor(config.seconds / step + 1e-9)) + 1;
  const FrameFormat format{config.size.width, config.size.height, fps, frames};
  const auto writer = MakeFrameWriter("--record", config.path, format);
  Offscreen offscreen(config.size);
  for (int64_t i = 0; i < frames; ++i) {
    const double seconds = alone ? config.seconds : static_cast<double>(i) * step;
    // Rounded, so that the time of a control step finds its own row.
    const double steps = std::round(seconds / kControlPeriod * 1e6) / 1e6;
    for (Episode& episode : view.episodes()) {
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
