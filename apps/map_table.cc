#include "apps/map_table.h"

#include <fmt/format.h>

#include <cmath>

#include "core/format.h"
#include "core/text.h"
#include "setup/config.h"

namespace upswing {
namespace {

/// "mass2 0.5 to 1.5 kg".
std::string RangeText(const MapAxis& axis) {
  return fmt::format("{} {:.4g} to {:.4g} {}", axis.name, axis.values.front(), axis.values.back(),
                     axis.unit);
}

std::string CheckText(const MapResult& map) {
  const MapAgreement a = map.agreement();
  std::string text =
      fmt::format("{} of {} cells again in MuJoCo: {} with as many successes", FormatCount(a.cells),
                  FormatCount(map.config.cells()),
                  a.same_successes == a.cells ? "all" : FormatCount(a.same_successes));
  if (a.same_successes < a.cells) {
    text += fmt::format(", the others differ by up to {:.0f}%", 100 * a.largest_success_difference);
  }
  if (a.both_succeed == 0) return text + ", no successes to compare";
  if (a.largest_swing_up_difference == 0) return text + ", swing-up times the same";
  return text +
         fmt::format(", swing-up times differ by up to {:.2f} s", a.largest_swing_up_difference);
}

}  // namespace

void PrintMapTable(const MapResult& map) {
  const MapConfig& config = map.config;
  fmt::print("{}\n", Printable(map.policy));
  fmt::print("  plant      {}, physics {}\n", PlantText(config.point.plant), map.physics);
  if (map.model) fmt::print("  model      {}\n", map.model->Text());
  fmt::print("  map        {} × {}: {} × {} cells, {} episode{} each\n", RangeText(config.x),
             RangeText(config.y), config.x.values.size(), config.y.values.size(), config.episodes,
             config.episodes == 1 ? "" : "s");
  if (!map.changes.empty()) fmt::print("  with       {}\n", map.changes);
  const std::string interval = map.success_interval();
  fmt::print("  success    {:.1f}% of all episodes; no failure in {:.1f}% of the cells{}\n",
             100 * map.mean_success(), 100 * map.always_success(),
             interval.empty() ? "" : Concat(" (", interval, ")"));
  if (std::isfinite(map.median_swing_up())) {
    fmt::print("  swing-up   {:.2f} s, median of the cells' medians\n", map.median_swing_up());
  } else {
    fmt::print("  swing-up   no episode stays upright\n");
  }
  fmt::print("  rate       {} episodes in {}: {} a second\n", FormatCount(map.episodes()),
             FormatDuration(map.seconds),
             FormatCount(static_cast<double>(map.episodes()) / map.seconds));
  if (!map.checked.empty()) fmt::print("  check      {}\n", CheckText(map));
  fmt::print("  written    {}\n", Printable(Join(map.files, ", ")));
}

}  // namespace upswing
