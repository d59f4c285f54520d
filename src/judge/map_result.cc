#include "judge/map_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/csv.h"
#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "os/file.h"
#include "report/figure.h"
#include "rl/train/evaluate.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

double RateOf(const MapResult& map, const MapCell& cell) {
  return static_cast<double>(cell.successes) / map.config.episodes;
}

Panel MapPanel(const MapResult& map, const std::string& title, HeatMap heat_map) {
  const MapAxis& x = map.config.x;
  const MapAxis& y = map.config.y;
  heat_map.x = x.values;
  heat_map.y = y.values;
  Panel panel{
      .title = title, .x_label = x.label(), .y_label = y.label(), .heat_map = std::move(heat_map)};
  const auto inside = [](const MapAxis& axis) {
    return axis.at_training && *axis.at_training >= axis.values.front() &&
           *axis.at_training <= axis.values.back();
  };
  if (!map.dot.empty() && inside(x) && inside(y)) {
    panel.lines.push_back({map.dot, {*x.at_training}, {*y.at_training}, {}, {}, true});
  }
  return panel;
}

/// The caption: episodes, engine, seed and changes.
std::string CaptionOf(const MapResult& map) {
  std::string text = Concat(Counted(map.config.episodes, "episode"), " per cell");
  if (const std::string interval = map.success_interval(); !interval.empty()) {
    text += Concat(" (", interval, ")");
  }
  text += Concat("; ", map.config.env.engine->name, "; seed ", map.config.env.seed);
  return map.changes.empty() ? text : Concat(text, "; ", map.changes);
}

HeatMap SuccessMap(const MapResult& map) {
  HeatMap success{.label = "successful episodes (%)", .high = 100};
  for (const MapCell& cell : map.cells) success.z.push_back(100 * RateOf(map, cell));
  return success;
}

Figure MapFigure(const MapResult& map) {
  HeatMap swing_up{.label = "swing-up time (s)"};
  double longest = 0;  // swing-up time, s
  for (const MapCell& cell : map.cells) {
    swing_up.z.push_back(cell.swing_up_seconds);
    longest = std::max(longest, cell.successes > 0 ? cell.swing_up_seconds : 0);
  }
  // If nothing has to swing up, the times differ too little for colours to show.
  if (longest < 0.1) swing_up.high = 1;
  const char* title = map.config.episodes > 1 ? "Swing-up time, median" : "Swing-up time";
  return {.title = map.policy,
          .panels = {MapPanel(map, "Success", SuccessMap(map)),
                     MapPanel(map, title, std::move(swing_up))},
          .columns = 2,
          .width = 1100,
          .height = 530,
          .caption = CaptionOf(map)};
}

/// A figure with a success panel for each policy.
Figure SuccessFigure(const std::vector<MapResult>& maps) {
  const int count = static_cast<int>(maps.size());
  const int columns = count == 4 ? 2 : std::min(3, count);
  const int rows = (count + columns - 1) / columns;
  Figure figure{.columns = columns,
                .width = 40 + 420 * columns,
                .height = 60 + 430 * rows,
                .caption = CaptionOf(maps.front())};
  for (int i = 0; i < count; ++i) {
    const MapResult& map = maps[static_cast<size_t>(i)];
    HeatMap success = SuccessMap(map);
    success.bar = i % columns == columns - 1 || i == count - 1;
    Panel& panel = figure.panels.emplace_back(MapPanel(map, map.title, std::move(success)));
    // One legend for all dots, at the bottom left.
    const bool names = i == (rows - 1) * columns;
    for (Line& line : panel.lines) line.name = names ? "training or design" : "";
  }
  return figure;
}

/// The map as a JSON object; numbers that are not finite become null.
ordered_json JsonOf(const MapResult& map) {
  const auto axis = [](const MapAxis& a) -> ordered_json {
    return {{"name", a.name}, {"unit", a.unit}, {"values", a.values}};
  };
  ordered_json j;
  j["policy"] = map.policy;
  j["seed"] = map.config.env.seed;
  j["physics"] = map.config.env.engine->name;
  for (const auto& [name, value] : PlantValues(map.config.point.plant)) j["plant"][name] = value;
  j["unknown_plant"] = map.config.env.assumed_plant.has_value();
  j["changes"] = map.changes;
  j["x"] = axis(map.config.x);
  j["y"] = axis(map.config.y);
  j["episodes_per_cell"] = map.config.episodes;
  j["mean_success_rate"] = map.mean_success();
  j["cells_without_failure"] = map.always_success();
  j["median_swing_up_seconds"] = map.median_swing_up();
  const size_t columns = map.config.x.values.size();
  for (size_t i = 0; i < map.cells.size(); ++i) {
    j["success_rate"][i / columns].push_back(RateOf(map, map.cells[i]));
    j["swing_up_seconds"][i / columns].push_back(map.cells[i].swing_up_seconds);
  }
  j["files"] = map.files;
  return j;
}

}  // namespace

double MapResult::mean_success() const {
  double sum = 0;
  for (const MapCell& cell : cells) sum += static_cast<double>(cell.successes);
  return sum / static_cast<double>(config.cells() * config.episodes);
}

double MapResult::always_success() const {
  const auto always = std::ranges::count_if(
      cells, [this](const MapCell& cell) { return cell.successes == config.episodes; });
  return static_cast<double>(always) / static_cast<double>(cells.size());
}

double MapResult::median_swing_up() const {
  std::vector<double> medians;
  for (const MapCell& cell : cells) {
    if (cell.successes > 0) medians.push_back(cell.swing_up_seconds);
  }
  if (medians.empty()) return std::numeric_limits<double>::quiet_NaN();
  return QuartilesOf(std::move(medians)).median;
}

std::string MapResult::success_interval() const {
  // All episodes from one given start are the same, unless there is noise.
  if (config.episodes == 1 && config.start_given) return "";
  const Interval interval = WilsonInterval(config.episodes, config.episodes);
  return fmt::format("{0} of {0}: 95% interval {1:.1f}% to 100%", config.episodes,
                     100 * interval.low);
}

std::string MapCsv(const MapResult& map) {
  const MapAxis &x = map.config.x, &y = map.config.y;
  CsvTable csv;
  for (size_t i = 0; i < map.cells.size(); ++i) {
    const MapCell& cell = map.cells[i];
    csv.Add(x.name, x.values[i % x.values.size()]);
    csv.Add(y.name, y.values[i / x.values.size()]);
    csv.Add("episodes", map.config.episodes);
    csv.Add("successes", cell.successes);
    csv.Add("success_rate", RateOf(map, cell));
    const bool known = cell.successes > 0;
    csv.Add("swing_up_seconds", known ? FormatNumber(cell.swing_up_seconds) : "");
    csv.EndRow();
  }
  return csv.text();
}

void CheckSameAxes(const std::vector<MapResult>& maps) {
  const MapConfig& first = maps.front().config;
  for (const MapResult& map : maps) {
    if (map.config.x.values == first.x.values && map.config.y.values == first.y.values) continue;
    throw BadInput(Concat(map.title, ": expected a policy with the same plant as ",
                          maps.front().title,
                          ", because percentages on an axis are relative to that plant, got ",
                          "another plant; numbers (--x mass2=0.5:1.5) suit all policies"));
  }
}

void WriteMaps(std::vector<MapResult>& maps, const fs::path& folder) {
  const bool several = maps.size() > 1;
  for (size_t i = 0; i < maps.size(); ++i) {
    const fs::path table = folder / (several ? Concat("map-", i + 1, ".csv") : "map.csv");
    WriteFileAtomically(table, MapCsv(maps[i]));
    maps[i].files = {table.string()};
  }
  const Figure figure = several ? SuccessFigure(maps) : MapFigure(maps.front());
  const auto drawn = DrawIfPossible(figure, folder / (several ? "maps" : "map"));
  for (MapResult& map : maps) map.files.insert(map.files.end(), drawn.begin(), drawn.end());
}

std::string MapsJson(const std::vector<MapResult>& maps) {
  if (maps.size() == 1) return PrintableJson(JsonOf(maps.front()));
  ordered_json list = ordered_json::array();
  for (const MapResult& map : maps) list.push_back(JsonOf(map));
  return PrintableJson(list);
}

}  // namespace upswing
