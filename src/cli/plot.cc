#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>

#include "agents/loaded_policy.h"
#include "base/csv.h"
#include "base/text.h"
#include "cli/commands.h"
#include "judge/plot_figures.h"
#include "judge/rollout.h"
#include "os/file.h"
#include "os/streams.h"
#include "pendulum/control_period.h"
#include "pendulum/start_text.h"
#include "report/figure.h"
#include "runs/find_policy.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

struct PlotArguments {
  PolicyArguments policy;
  std::string out;
  TrialArguments trial;
  double seconds = -1;  // negative: not given
  bool phase = false;
};

/// Start (s) of the last upright stretch, which lasts to the end; negative if the end is not
/// upright.
double UprightSince(const std::vector<RolloutRow>& rows) {
  double since = -1;
  for (const RolloutRow& row : rows) {
    if (!row.inverted) since = -1;
    if (row.inverted && since < 0) since = row.t;
  }
  return since;
}

/// The caption below the title: the episode, and how it differs from the training.
std::string Caption(const PlotArguments& a, const RolloutConfig& config, const Rollout& rollout,
                    const LoadedPolicy& loaded) {
  std::string start = Concat("start ", a.trial.start);
  if (a.trial.start.empty()) start = "start 0,0,0,0";
  if (a.trial.is_of_eval()) start = Concat("episode ", a.trial.episode, " of eval");
  std::vector<std::string> parts{start, Concat("seed ", a.trial.seed), a.trial.physics};
  if (rollout.goal) parts.push_back(Concat("goal ", PoseName(*rollout.goal)));
  for (const auto& [now, before] : Differences(OptionsOf(rollout.plant), OptionsOf(loaded.plant))) {
    parts.push_back(fmt::format("{} {:.4g} {} ({}: {:.4g})", now.name, now.number(), now.unit,
                                loaded.origin(), before->number()));
  }
  if (const std::string changes = ChangesText(config.env); !changes.empty()) {
    parts.push_back(changes);
  }
  return Join(parts, "; ");
}

/// The sums of the reward's terms in the training's episodes, each a mean over a hundredth of the
/// training. Nothing if `run` is no run folder with a finished episode.
std::optional<Figure> TermsFigure(const fs::path& run) {
  const fs::path table = run / RunFolder::kEpisodes;
  if (!fs::is_regular_file(table)) return std::nullopt;
  const std::string text = ReadInput(table.string());
  std::vector<std::string> names = CsvNames(text, table.string());
  if (names.size() < 6) return std::nullopt;
  names.erase(names.begin() + 1, names.begin() + 5);  // keep step and the terms
  const std::vector<CsvColumn> columns = ReadCsv(text, names, table.string());
  const std::vector<double>& step = columns[0].values;
  if (step.empty()) return std::nullopt;
  Panel panel{.x_label = "step", .y_label = "sum of a training episode"};
  for (size_t k = 1; k < names.size(); ++k) {
    Line line{.name = names[k]};
    for (size_t i = 0, end = 0; i < step.size(); i = end) {
      // Episodes within 1% of the steps make one point.
      const double beyond = step[i] + step.back() / 100;
      double sum = 0;
      do {
        sum += columns[k].values[end];
        ++end;
      } while (end < step.size() && step[end] < beyond);
      line.x.push_back(step[end - 1]);
      line.y.push_back(sum / static_cast<double>(end - i));
    }
    panel.lines.push_back(std::move(line));
  }
  return Figure{.panels = {panel}, .height = 400};
}

int RunPlot(const PlotArguments& a) {
  const LoadedPolicy loaded = GetPolicyIn(a.trial, a.policy);
  RolloutConfig config = TrialEpisode(a.trial, &loaded);
  const double usual = a.trial.is_of_eval() ? kEvaluationSeconds * config.env.scale.time : 10;
  config.seconds =
      InWholePeriods("--seconds", a.seconds < 0 ? usual : a.seconds, config.env.control_period);
  config.estimates = true;
  const fs::path folder = FigureFolder(a.out, loaded, "plot");
  CheckCanDraw();
  const Rollout rollout = RunRollout(config);

  MakeNewFolder(folder);
  std::vector<std::pair<std::string, Figure>> figures{
      {"episode", EpisodeFigure(rollout, *loaded.policy)}};
  if (a.phase) figures.emplace_back("phase", PhaseFigure(rollout));
  if (auto terms = TermsFigure(a.policy.name)) figures.emplace_back("terms", std::move(*terms));
  std::vector<std::string> files;
  for (auto& [name, figure] : figures) {
    figure.title = loaded.name;
    if (name != "terms") figure.caption = Caption(a, config, rollout, loaded);
    std::ranges::move(DrawIfPossible(figure, folder / name), std::back_inserter(files));
  }
  fmt::print("{}\n", Printable(loaded.name));
  fmt::print("  plant      {}, physics {}\n", EpisodeText(rollout), a.trial.physics);
  fmt::print("  start      {}\n", StateText(rollout.rows.front().state));
  const double since = UprightSince(rollout.rows);
  const char* place = config.env.any_pose ? "at goal" : "upright";
  std::string when = "not at the end";
  if (since >= 0) when = fmt::format("from {:.2f} s to the end", since);
  fmt::print("  {:<10} {}\n", place, when);
  fmt::print("  torque     {}\n", TorqueText(rollout));
  fmt::print("  reward     {}\n", RewardText(rollout));
  if (a.trial.is_of_eval()) {
    fmt::print("  episode    {} of eval: {}\n", a.trial.episode,
               JudgementText(*loaded.policy, config.env));
  }
  fmt::print("  written    {}\n", Printable(Join(files, ", ")));
  return 0;
}

}  // namespace

void AddPlot(CommandLine& line) {
  PlotArguments& a = line.Runs(RunPlot);
  AddPolicy(line, a.policy);
  line.Require("policy");
  AddEpisodeOptions(line, a.trial);
  Options own;
  Option& seconds = own.Add(&a.seconds, "seconds", {0.1, 1000}, "s", "length of the episode");
  seconds.usual = "10; 20 with --episode";
  line.Arguments(own);
  AddTrialOptions(line, a.trial, "noise, random plants and the start of --episode");
  line.Flag("--phase", a.phase,
            "draw phase portraits, too: the angle of each joint against its velocity");
  line.Text("--out", a.out, "FOLDER", "new folder for the figures (default RUN/plot)");
  line.Notes(
      "episode.svg and .png show angles, velocities, energy, torque, reward terms and the\n"
      "policy's estimates over time: Q-values, or the actor's mean torque with its central\n"
      "68% interval, and V.\n"
      "With --phase, phase.svg and .png show q1 against w1 and q2 against w2.\n"
      "Of a run folder, terms.svg and .png show the sums of the reward's terms over training.\n"
      "`simulate` writes the same episode as a table.\n\n"
      "Without --out, the figures go into plot in the run folder, or into runs/plot-NAME for\n"
      "another policy file; the next figures into plot-2.\n");
  line.Examples(
      "  ./upswing plot runs/d3qn-seed1\n"
      "  ./upswing plot runs/d3qn-seed1 --start 170deg,0,0,0 --seconds 5 --out caught\n"
      "  ./upswing plot runs/d3qn-seed1 --set mass2=1.3\n"
      "  ./upswing plot mpc --phase --seconds 4\n"
      "  ./upswing plot runs/d3qn-seed1 --randomize 0.25 --episode 17\n");
}

}  // namespace upswing
