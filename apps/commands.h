#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "setup/config.h"
#include "setup/loaded_policy.h"

namespace upswing {

/// What the chosen subcommand does; returns the exit code.
using Command = std::function<int()>;

/// Each adds its subcommand to the program and sets `command` when it is the one that was typed.
void AddTrain(CLI::App& program, Command& command);
void AddBounds(CLI::App& program, Command& command);
void AddEval(CLI::App& program, Command& command);
void AddSimulate(CLI::App& program, Command& command);
void AddMap(CLI::App& program, Command& command);
void AddPlot(CLI::App& program, Command& command);
void AddInfo(CLI::App& program, Command& command);
void AddCompare(CLI::App& program, Command& command);
void AddStudy(CLI::App& program, Command& command);
void AddExport(CLI::App& program, Command& command);
void AddView(CLI::App& program, Command& command);
void AddRealAiGym(CLI::App& program, Command& command);
void AddBench(CLI::App& program, Command& command);

/// Refuses an empty text, such as that of a shell variable that is not set, for `what` is expected.
CLI::Validator NotEmpty(const std::string& what = "a path");

/// Adds a flag for each of a command's own arguments, which sets it at once; see Option::Set.
void AddArguments(CLI::App& app, const Options& options);

/// Adds a flag for each setting and alias, in the order in which they were described. What is given
/// is added to `flags`.
void AddSettings(CLI::App& app, const Options& options, std::vector<FlagValue>& flags);

/// Lets --help show of `every` setting those of `options`, with their values now as defaults.
void ShowDefaults(CLI::App& app, const Options& every, const Options& options);

/// Adds the policy to try, a file, a run folder or a controller, and the controllers' settings; not
/// required unless the caller says so.
CLI::Option* AddPolicy(CLI::App& app, PolicyArguments& a);

/// Adds the settings of controllers and --made-for.
void AddControllers(CLI::App& app, PolicyArguments& a);

/// Adds --start, which ParseStart reads.
void AddStart(CLI::App& app, std::optional<std::string>& start);

/// Adds --seed, with `what` it is of.
void AddSeed(CLI::App& app, int64_t& seed, const std::string& what);

/// Adds --threads, which ResolveThreads reads.
void AddThreads(CLI::App& app, int64_t& threads);

/// Adds --physics, which FindEngine reads.
void AddPhysics(CLI::App& app, std::string& physics);

/// Adds --seeds and --jobs, for many runs; 0 jobs: as many as there are processors.
void AddManyOptions(CLI::App& app, std::string& seeds, int64_t& jobs);

/// Adds --set, which ApplyChanges reads.
void AddSet(CLI::App& app, std::vector<std::string>& set, const std::string& help);

/// Adds --set and --model, which choose another plant.
void AddPlantOptions(CLI::App& app, std::vector<std::string>& set, std::string& model);

/// Adds --unknown-plant: observations are scaled as in training, also on another plant.
void AddUnknownPlant(CLI::App& app, bool& unknown_plant);

}  // namespace upswing
