#include "apps/trial_options.h"

#include "apps/commands.h"

namespace upswing {

void AddTrialOptions(CLI::App& app, TrialArguments& a, const std::string& seed_of) {
  AddSeed(app, a.seed, seed_of);
  AddPlantOptions(app, a.set, a.model);
  AddPhysics(app, a.physics);
  AddUnknownPlant(app, a.unknown_plant);
  TrialConditions defaults;
  AddSettings(app, OptionsOf(defaults), a.flags);
  // Mistakes on the command line are reported before any file is read.
  app.parse_complete_callback([&a] { (void)ConditionsOf(a); });
}

void AddEpisodeOptions(CLI::App& app, EpisodeArguments& a) {
  AddStart(app, a.start);
  Options own;
  own.Add(&a.number, "episode", {0, 999999}, "", "that of `eval` with the same flags, from 0")
      .usual = "none";
  AddArguments(app, own);
}

}  // namespace upswing
