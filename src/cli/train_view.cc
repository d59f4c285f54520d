#include "cli/train_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "agents/config_checks.h"
#include "base/format.h"
#include "base/stopwatch.h"
#include "base/text.h"
#include "cli/eval_table.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "mujoco/engines.h"
#include "os/file.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

/// Number of updates by an agent's metrics; 0 if they have none.
int64_t UpdatesIn(const Metrics& metrics) {
  const auto updates = std::ranges::find(metrics, "updates", &Metrics::value_type::first);
  return updates == metrics.end() ? 0 : static_cast<int64_t>(updates->second);
}

/// The printed view of a training: a progress line, a line per evaluation, a summary.
class TrainView : public TrainObserver {
 public:
  /// Shows a training, which must outlive the view, from its current step on.
  explicit TrainView(const Training& training)
      : training_(training),
        seconds_before_(training.state().seconds),
        begin_step_(training.state().steps),
        since_step_(training.state().steps),
        since_updates_(training.agent().updates()),
        since_seconds_(training.state().seconds) {}

  /// Prints agent, sizes and folder.
  void Announce(const std::filesystem::path& run) const {
    const Config& config = training_.config();
    Say("Training {} (seed {}) in {}\n", config.agent, config.train.seed, Printable(run.string()));
    Say("  {}, {} parameters; {}, {}\n", config.learner().Text(),
        FormatCount(training_.policy()->num_parameters()),
        Counted(config.train.envs, "environment"), Counted(training_.threads(), "thread"));
    if (config.physics != kMuJoCo.name) Say("  physics {}\n", config.physics);
    if (!config.is_foreign() && config.scale() != Scale()) {
      Say("  a plant of another size: times × {:.4g}, torques × {:.4g}\n", config.time_scale,
          config.torque_scale);
    }
    if (!config.is_foreign() && config.control_period != kControlPeriod) {
      Say("  a decision every {:.4g} s\n", config.control_period);
    }
    const TrainingSize size = SizeOf(config);
    constexpr double kGigabyte = 1e9;
    if (size.memory > kGigabyte) {
      Say("  up to {:.1f} GB of memory and {:.1f} GB of disk for the checkpoint\n",
          size.memory / kGigabyte, size.checkpoint / kGigabyte);
    }
    for (const std::string& warning : Warnings(config)) Say("  Warning: {}\n", warning);
    if (since_step_ > 0) Say("  resuming at step {}\n", FormatCount(since_step_));
    std::fflush(stdout);
  }

  void OnMetrics(const TrainState& s, const Metrics& metrics) override {
    metrics_ = metrics;
    UpdateRates(s);
  }

  void OnConfirm(const TrainState& s) override {
    if (line_.terminal() && IsScreened(training_.config())) {
      line_.Show(Share(s), {"success 100%, confirming in MuJoCo"});
    }
  }

  void OnEvaluation(const TrainState& s, const Evaluation& e) override {
    value_ = e.value;
    discounted_return_ = e.discounted_return;
    line_.Print(
        fmt::format("{:>9} steps  {:>11}  {:>6} updates/s  {}  return {:6.0f}  success {:3}/{}{}",
                    FormatCount(s.steps), FormatDuration(s.seconds), UpdatesText(),
                    Join(AgentTexts(), "  "), e.reward_sum.mean, e.successes, e.episodes,
                    e.diverged > 0 ? fmt::format("  diverged {}", e.diverged) : ""));
  }

  /// Updates the progress line if it is due. Returns the request of a signal.
  TrainRequest Poll() {
    if (line_.due()) ShowProgress(training_.state());
    return PollSignals();
  }

  /// Prints the result and the next commands to type. `finished`: the training was not stopped.
  void Summarize(const std::filesystem::path& run, bool finished) {
    const TrainState& s = training_.state();
    const TrainConfig& config = training_.config().train;
    line_.Clear();
    PrintOutcome(finished);
    const std::filesystem::path policy = run / RunFolder::kPolicy;
    const bool has_policy = s.best_step > 0 && Exists(policy);
    if (has_policy) {
      const bool unconfirmed =
          IsScreened(training_.config()) && !s.solved && s.best_success_rate == 1;
      Say("Best policy: {} (step {}, success {:.0f}%{}, return {:.0f})\n",
          Printable(policy.string()), FormatCount(s.best_step), 100 * s.best_success_rate,
          unconfirmed ? " in closed-form physics" : "", s.best_return);
    } else if (s.best_step > 0) {
      Say("Best policy: from step {}, but {} no longer exists\n", FormatCount(s.best_step),
          Printable(policy.string()));
    }
    if (s.solved && !training_.config().learner().HasSoftValues() &&
        ValueIsOff(value_, discounted_return_)) {
      Say("Warning: the agent expected a discounted return of {:.4g} and got {:.4g}, more than a\n"
          "quarter off. The success above is measured and does not depend on this estimate.\n",
          value_, discounted_return_);
    }
    if (Printable(run.string()) != run.string()) return;  // such a name cannot be typed
    const std::string folder = ShellQuoted(run.string());
    Say("Next:\n");
    if (has_policy) {
      Say("  {0} demo {1}\n  {0} eval {1}\n  {0} info {1}\n", LaunchCommand(), folder);
    }
    std::string how;
    if (finished && s.solved && config.stop_when_solved) how += " --no-stop-when-solved";
    if (finished && s.steps >= config.steps) how += fmt::format(" --steps {}", 2 * s.steps);
    Say("  {} train --resume {}{}\n", LaunchCommand(), folder, how);
  }

 private:
  /// Share of the steps that are done.
  double Share(const TrainState& s) const {
    return static_cast<double>(s.steps) / static_cast<double>(training_.config().train.steps);
  }

  void UpdateRates(const TrainState& s) {
    const double elapsed = s.seconds - since_seconds_;
    const bool is_long = elapsed >= 0.5;
    if (elapsed <= 0 || (rates_settled_ && !is_long)) return;
    const int64_t updates = UpdatesIn(metrics_);
    steps_per_second_ = static_cast<double>(s.steps - since_step_) / elapsed;
    updates_per_second_ = static_cast<double>(updates - since_updates_) / elapsed;
    if (!is_long) return;
    rates_settled_ = true;
    since_step_ = s.steps;
    since_updates_ = updates;
    since_seconds_ = s.seconds;
  }

  /// The rate of updates; a dash before it is known.
  std::string UpdatesText() const {
    return steps_per_second_ > 0 ? FormatCount(updates_per_second_) : "-";
  }

  /// The agent's metrics, such as `eps 0.05` and `loss 0.0012`.
  std::vector<std::string> AgentTexts() const {
    const bool learned = UpdatesIn(metrics_) > 0;
    std::vector<std::string> texts;
    for (const auto& [name, value] : metrics_) {
      if (name == "alpha") texts.push_back(fmt::format("alpha {:.3f}", value));
      if (name == "epsilon") texts.push_back(fmt::format("eps {:.2f}", value));
      if (name == "std") texts.push_back(fmt::format("std {:.2f}", value));
      if (name == "loss") {
        texts.push_back(learned ? fmt::format("loss {:.4f}", value) : "loss      -");
      }
    }
    return texts;
  }

  void ShowProgress(const TrainState& s) {
    const int64_t steps_in_all = training_.config().train.steps;
    const auto steps_left = static_cast<double>(steps_in_all - s.steps);
    std::vector<std::string> fields{fmt::format("success {:.0f}%", 100 * s.last_success_rate),
                                    fmt::format("return {:.0f}", s.mean_return())};
    if (steps_per_second_ > 0) {
      fields.insert(fields.begin(),
                    fmt::format("at most {} left", FormatDuration(steps_left / steps_per_second_)));
      fields.push_back(fmt::format("{} steps/s", FormatCount(steps_per_second_)));
      fields.push_back(fmt::format("{} updates/s", UpdatesText()));
    }
    for (const std::string& text : AgentTexts()) fields.push_back(text);
    line_.Show(Share(s), fields);
  }

  /// Prints the outcome in one sentence.
  void PrintOutcome(bool finished) const {
    const TrainState& s = training_.state();
    const TrainConfig& config = training_.config().train;
    const bool did_nothing = begin_step_ > 0 && s.steps == begin_step_ && finished;
    const bool all_steps_done = s.steps >= config.steps;
    if (did_nothing && all_steps_done) {
      Say("Nothing to do: the run has all {} steps (--steps is the total){}.\n",
          FormatCount(config.steps), s.solved ? " and is solved" : "");
    } else if (did_nothing) {
      Say("Nothing to do: the run was solved at step {} after {} of training. With\n"
          "--no-stop-when-solved it continues to step {} (--steps).\n",
          FormatCount(s.streak_step), FormatDuration(s.streak_seconds), FormatCount(config.steps));
    } else if (s.solved) {
      Say("Solved after {} of training, at step {} (in all {} steps, {} with evaluations).\n",
          FormatDuration(s.streak_seconds), FormatCount(s.streak_step), FormatCount(s.steps),
          Elapsed());
    } else {
      Say("{} at step {} after {} of training ({} with evaluations); not solved yet.\n",
          finished ? "Done" : "Stopped", FormatCount(s.steps), FormatDuration(s.seconds),
          Elapsed());
    }
  }

  /// Time by the clock. Earlier sessions of a resumed run count without their evaluations.
  std::string Elapsed() const { return FormatDuration(seconds_before_ + session_.seconds()); }

  const Training& training_;
  ProgressLine line_;
  Stopwatch session_;
  double seconds_before_;                     // training time before this view
  int64_t begin_step_;                        // of the training in this view
  Metrics metrics_;                           // last reported
  double value_ = 0, discounted_return_ = 0;  // of the last evaluation

  // Training rates between two reports at least half a second apart. Until there are two such
  // reports, the rates over all reports; 0 before the first report.
  double steps_per_second_ = 0, updates_per_second_ = 0;
  bool rates_settled_ = false;
  int64_t since_step_, since_updates_;
  double since_seconds_;
};

}  // namespace

bool TrainAndShow(TrainingRun& run) {
  TrainView view(run.training());
  view.Announce(run.path());
  const bool finished = run.Train(view, [&] { return view.Poll(); });
  view.Summarize(run.path(), finished);
  return finished;
}

}  // namespace upswing
