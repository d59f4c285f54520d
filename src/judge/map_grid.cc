#include "judge/map_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>

#include "base/error.h"
#include "base/text.h"
#include "pendulum/start_text.h"
#include "rl/train/evaluate.h"

namespace upswing {
namespace {

constexpr int64_t kDefaultCells = 31;  // odd: the middle of ±50% is a cell
constexpr int64_t kMostCells = 1000;
// Episodes that step together: whole vectors, with network and activations in the L2 cache.
constexpr int kTaskEpisodes = 64;

/// Swing-up time (s) of an episode that succeeds.
using EpisodeResult = std::optional<double>;

/// The common value of the settings; none if they differ.
std::optional<double> CommonValue(const std::vector<const Option*>& members) {
  const double first = members.front()->number();
  for (const Option* member : members) {
    if (member->number() != first) return std::nullopt;
  }
  return first;
}

/// The value of a start angle or velocity, in the unit of its setting; nothing for another setting.
std::optional<double> StartValue(std::string_view name, std::string_view text,
                                 const std::string& where) {
  if (name == "q1" || name == "q2") return ParseDegrees(text, where);
  if (name == "w1" || name == "w2") return ParseVelocity(text, where);
  return std::nullopt;
}

/// An end of an axis: a number, or a percentage relative to the training's value.
double ParseEnd(std::string_view text, const MapAxis& axis, const std::string& where) {
  if (const auto value = StartValue(axis.name, text, where)) return *value;
  const bool percent = text.ends_with('%');
  if (percent) text.remove_suffix(1);
  const auto number = ParseNumber(text);
  if (!number || !std::isfinite(*number)) {
    throw BadInput(Concat(where, ": expected a number or a percentage, got \"", text, "\""));
  }
  if (!percent) return *number;
  if (!axis.at_training || *axis.at_training == 0) {
    throw BadInput(Concat(where, ": expected a number, got a percentage of ",
                          axis.at_training ? "a training value of 0" : "unequal training values"));
  }
  return *axis.at_training * (1 + *number / 100);
}

int64_t ParseCells(std::string_view text, const std::string& where) {
  const auto cells = ParseInteger(text);
  if (!cells || *cells < 2 || *cells > kMostCells) {
    throw BadInput(Concat(where, ": expected 2 to ", kMostCells, " cells, got \"", text, "\""));
  }
  return *cells;
}

/// Runs `count` consecutive episodes of the map together, from one or more cells.
std::vector<EpisodeResult> RunRange(const MapConfig& config, const Policy& policy, int64_t first,
                                    int count) {
  PendulumEnvConfig env_config = config.env;
  env_config.num_envs = count;
  env_config.stream = "map";
  env_config.first_index = static_cast<uint64_t>(first);
  env_config.plants.clear();
  env_config.disturbances.clear();
  for (int i = 0; i < count; ++i) {
    const MapPoint point = config.PointOf((first + i) / config.episodes);
    env_config.plants.push_back(point.plant);
    env_config.disturbances.push_back(point.disturbance);
  }
  PendulumEnv env(env_config);
  if (config.start_given) {
    for (int i = 0; i < count; ++i) {
      env.SetState(i, config.PointOf((first + i) / config.episodes).start());
    }
  }

  std::vector<EpisodeResult> results;
  for (const EvaluationEpisode& episode : EvaluateEpisodes(policy, env)) {
    results.push_back(episode.success ? episode.swing_up_seconds : std::nullopt);
  }
  return results;
}

MapCell CellOf(std::span<const EpisodeResult> episodes) {
  std::vector<double> seconds;
  for (const EpisodeResult& episode : episodes) {
    if (episode) seconds.push_back(*episode);
  }
  const auto successes = static_cast<int64_t>(seconds.size());
  const double none = std::numeric_limits<double>::quiet_NaN();
  return {successes, seconds.empty() ? none : QuartilesOf(std::move(seconds)).median};
}

}  // namespace

void MapPoint::Describe(Options& o) {
  plant.Describe(o);
  disturbance.Describe(o, control_period);
  o.Section("start");
  o.Add(&q1, "q1", {-360, 360}, "°", "start angle of link 1; 0: hanging");
  o.Add(&q2, "q2", {-360, 360}, "°", "start angle of link 2 relative to link 1");
  o.Add(&w1, "w1", {-50, 50}, "rad/s", "start velocity of q1");
  o.Add(&w2, "w2", {-50, 50}, "rad/s", "start velocity of q2");
}

PendulumState MapPoint::start() const {
  constexpr double kDegree = std::numbers::pi / 180;
  return {q1 * kDegree, q2 * kDegree, w1, w2};
}

std::string MapAxis::label() const { return unit.empty() ? name : Concat(name, " (", unit, ")"); }

bool MapAxis::Sets(const std::string& setting) const {
  return std::ranges::find(settings, setting) != settings.end();
}

std::vector<std::string> InUnitsOfMap(std::vector<std::string> changes, const std::string& flag) {
  for (std::string& change : changes) {
    const std::string_view text = change;
    const size_t equals = text.find('=');
    if (equals == std::string_view::npos) continue;  // ApplyChanges reports it
    const std::string name(Trim(text.substr(0, equals)));
    const auto value = StartValue(name, text.substr(equals + 1), Concat(flag, " ", name));
    if (value) change = Concat(name, "=", FormatNumber(*value));
  }
  return changes;
}

MapAxis ParseMapAxis(const std::string& text, const MapPoint& training, const std::string& where) {
  const size_t equals = text.find('=');
  const auto pieces = Split(std::string_view(text).substr(std::min(equals, text.size())), ':');
  if (equals == std::string::npos || pieces.size() < 2 || pieces.size() > 3) {
    std::vector<std::string> names;
    MapPoint point;
    const Options options = OptionsOf(point);
    for (const Option& option : options.all()) names.push_back(option.name);
    for (const auto& alias : options.aliases()) names.push_back(alias.name);
    throw BadInput(Concat(where, ": expected NAME=FROM:TO or NAME=FROM:TO:CELLS, got \"", text,
                          "\"; NAME is one of ", Join(names, ", ")));
  }
  MapAxis axis;
  axis.name = Trim(std::string_view(text).substr(0, equals));
  const std::string place = Concat(where, " ", axis.name);
  MapPoint point = training;
  const Options options = OptionsOf(point);
  const std::vector<const Option*> members = options.Find(axis.name, where);
  for (const Option* member : members) axis.settings.push_back(member->name);
  axis.unit = members.front()->unit;
  axis.start = members.front()->section == "start";
  axis.at_training = CommonValue(members);

  const double from = ParseEnd(pieces[0].substr(1), axis, place);
  const double to = ParseEnd(pieces[1], axis, place);
  for (const double end : {from, to}) options.Set(axis.name, FormatNumber(end), place);
  if (from >= to) {
    throw BadInput(
        Concat(place, ": expected FROM < TO, got ", FormatNumber(from), " and ", FormatNumber(to)));
  }
  // A setting with steps has a cell per step by default.
  const double step = members.front()->step;
  const int64_t usual = step > 0 ? std::llround((to - from) / step) + 1 : kDefaultCells;
  const int64_t cells = pieces.size() == 3 ? ParseCells(pieces[2], place) : usual;
  for (int64_t i = 0; i < cells; ++i) {
    if (i == 0) {
      axis.values.push_back(from);
    } else if (i == cells - 1) {
      axis.values.push_back(to);
    } else {
      // With these weights, the middle of the axis is exact.
      axis.values.push_back(
          (from * static_cast<double>(cells - 1 - i) + to * static_cast<double>(i)) /
          static_cast<double>(cells - 1));
    }
    options.Set(axis.name, FormatNumber(axis.values.back()), place);
  }
  return axis;
}

MapPoint MapConfig::PointOf(int64_t cell) const {
  MapPoint result = point;
  const Options options = OptionsOf(result);
  const auto set = [&](const MapAxis& axis, size_t index) {
    for (const std::string& setting : axis.settings) {
      *std::get<double*>(options.Get(setting)->target) = axis.values[index];
    }
  };
  const auto i = static_cast<size_t>(cell);
  set(x, i % x.values.size());
  set(y, i / x.values.size());
  return result;
}

std::vector<MapCell> RunMap(const MapConfig& config, const Policy& policy, ThreadPool& pool,
                            const Progress& progress) {
  const int64_t total = config.cells() * config.episodes;
  std::vector<EpisodeResult> episodes(static_cast<size_t>(total));
  std::mutex mutex;
  double done = 0;
  std::atomic<bool> failed = false;  // stops the other ranges, as Ctrl-C in Python does
  const int64_t ranges = (total + kTaskEpisodes - 1) / kTaskEpisodes;
  pool.ParallelFor(static_cast<int>(ranges), [&](int range) {
    if (failed) return;
    const int64_t first = int64_t{range} * kTaskEpisodes;
    const int count = static_cast<int>(std::min<int64_t>(total - first, kTaskEpisodes));
    try {
      std::ranges::copy(RunRange(config, policy, first, count), episodes.begin() + first);
      const std::lock_guard lock(mutex);
      done += count;
      if (progress) progress(done, static_cast<double>(total));
    } catch (...) {
      failed = true;
      throw;
    }
  });
  std::vector<MapCell> map;
  const auto count = static_cast<size_t>(config.episodes);
  for (size_t first = 0; first < episodes.size(); first += count) {
    map.push_back(CellOf(std::span(episodes).subspan(first, count)));
  }
  return map;
}

}  // namespace upswing
