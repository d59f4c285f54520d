// Target: a plant file, which `--plant` reads, and a machine's twin, which `run`, `fake` and
// `machine` read. A twin is a plant file.
#include <algorithm>
#include <cmath>

#include "extras/machine/twin/twin.h"
#include "pendulum/posterior.h"
#include "runs/plant_file.h"
#include "tools/fuzz/target.h"

namespace upswing {

using namespace machine;
namespace {

/// Checks that all numbers of a struct are finite.
template <typename Values>
void ExpectFinite(const Values& values) {
  const Options options = OptionsOf(values);
  Expect(std::ranges::all_of(options.all(),
                             [](const Option& option) {
                               return !std::holds_alternative<double*>(option.target) ||
                                      std::isfinite(option.number());
                             }),
         "finite numbers");
}

/// Uses the conditions of a plant file as a training does.
void TryConditions(const PlantFile& file) {
  for (const FlagValue& flag : file.conditions) {
    if (flag.name != "posterior") continue;
    Posterior posterior;
    if (!Accepts([&] { posterior = Posterior::Parse(flag.text, flag.where); })) continue;
    Plant plant = file.plant;
    Disturbance disturbance;
    Rng rng(1, "fuzz");
    posterior.Deviate(plant, disturbance, rng);
    ExpectFinite(plant);
    ExpectFinite(disturbance);
  }
}

}  // namespace

bool TryInput(std::string_view input) {
  PlantFile file;
  const bool is_plant = Accepts([&] { file = ParsePlantFile(input, kInputName); });
  if (is_plant) TryConditions(file);
  Twin twin;
  if (!Accepts([&] { twin = ParseTwin(input, kInputName); })) return is_plant;
  const std::string text = TwinText(twin);
  Expect(TwinText(ParseTwin(text, kInputName)) == text, "to read the twin that was written");
  Rng rng(1, "fuzz");
  ExpectFinite(DrawTwin(twin, rng));
  return true;
}

}  // namespace upswing
