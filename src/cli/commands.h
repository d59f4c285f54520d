#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "judge/trial.h"
#include "runs/find_policy.h"

namespace upswing {

// Declarations of the commands; each has a source file with its name.
void AddTrain(CommandLine& line);
void AddEval(CommandLine& line);
void AddSimulate(CommandLine& line);
void AddGrade(CommandLine& line);
void AddMap(CommandLine& line);
void AddPlot(CommandLine& line);
void AddView(CommandLine& line);
void AddPlantCommand(CommandLine& line);
void AddInfo(CommandLine& line);
void AddCompare(CommandLine& line);
void AddStudy(CommandLine& line);
void AddCompletion(CommandLine& line);

/// Adds the policy argument (a file, a run folder, a shipped policy or a controller) and the
/// controllers' settings.
void AddPolicy(CommandLine& line, PolicyArguments& a);

/// Gets the policy of the arguments for a trial. If it is carried over to a plant of another size,
/// says so on standard error. Throws as GetPolicy does.
LoadedPolicy GetPolicyIn(const TrialArguments& trial, PolicyArguments a);
/// The same for several, as GetPolicies gets them; `undesigned` also gets the controllers that
/// cannot be designed for the plant of the trial.
std::vector<LoadedPolicy> GetPoliciesIn(const TrialArguments& trial,
                                        const std::vector<std::string>& names,
                                        PolicyArguments controllers,
                                        std::vector<Undesigned>* undesigned = nullptr);

/// What an argument for several policies takes: `policy.safetensors, run folders, …`.
std::string PolicyWords();

/// Adds the settings of controllers and --made-for.
void AddControllers(CommandLine& line, PolicyArguments& a);

/// Adds --seed, the seed of `what`.
void AddSeed(CommandLine& line, int64_t& seed, const std::string& what);

/// Adds --threads, the argument of ResolveThreads.
void AddThreads(CommandLine& line, int64_t& threads);

/// Adds --physics, the name of an engine.
void AddPhysics(CommandLine& line, std::string& physics);

/// Adds --seeds and --jobs, for many runs; 0 jobs: one per processor.
void AddManyOptions(CommandLine& line, std::string& seeds, int64_t& jobs);

/// Adds --set, the argument of ApplyChanges.
void AddSet(CommandLine& line, std::vector<std::string>& set,
            const std::string& help =
                "change of the plant, such as mass2=1.2; mass, length and "
                "damping change both links");

/// Adds a flag for each setting of a plant. Their values are appended to `flags`.
void AddPlantFlags(CommandLine& line, std::vector<FlagValue>& flags);

/// Warns of a plant or twin called `name` that is not to be trusted: `distrust` says why; empty: it
/// is to be trusted.
void WarnOfDistrust(const std::string& name, const std::string& distrust);

/// Adds --plant, the argument of ReadPlantFile. Warns if the plant is not to be trusted.
void AddPlant(CommandLine& line, std::string& plant);

/// Adds --overwrite, which lets the command replace the file of an output.
void AddOverwrite(CommandLine& line, bool& overwrite);

/// Adds --unknown-plant: on another plant, observations are still scaled as in training.
void AddUnknownPlant(CommandLine& line, bool& unknown_plant);

/// Adds --plant, --set, --physics, --seed (of `seed_of`), --unknown-plant, and the settings of
/// Disturbance and Randomization: the conditions of `eval`, `simulate` and `plot`.
void AddTrialOptions(CommandLine& line, TrialArguments& a, const std::string& seed_of);

/// Says on standard error why there will be tables only, if figures cannot be drawn.
void SayIfNoFigures();

/// Adds --start and --episode: the single episode of `simulate`, `plot` and `view`.
void AddEpisodeOptions(CommandLine& line, TrialArguments& a);

}  // namespace upswing
