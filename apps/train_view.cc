#include "apps/train_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <optional>

#include "apps/config_checks.h"
#include "apps/model_info.h"
#include "apps/say.h"
#include "core/text.h"

namespace upswing {

TrainView::TrainView(const TrainState& state, const AgentReport& report)
    : begin_step_(state.steps),
      report_(report),
      since_step_(state.steps),
      since_updates_(report.updates),
      since_seconds_(state.seconds) {}

void TrainView::Announce(const Config& config, int threads, size_t num_parameters,
                         const std::filesystem::path& run) const {
  const DqnConfig& d = config.dqn;
  Say("Training {} (seed {}) in {}\n", config.agent, config.train.seed, Printable(run.string()));
  Say("  {}{} network {}{}, {} parameters; {} environments, {} thread{}\n",
      d.double_q ? "double, " : "", d.dueling ? "dueling" : "plain", fmt::join(d.hidden, "-"),
      d.dueling ? fmt::format(" with heads of {}", d.head) : "", FormatCount(num_parameters),
      config.train.envs, threads, threads == 1 ? "" : "s");
  if (config.physics != PhysicsNames().front() || d.precision != "float32") {
    Say("  physics {}, products in {}\n", config.physics, d.precision);
  }
  const std::optional<ModelInfo> model = InfoOfModel(config.mjcf, config.model);
  if (model) Say("  model {}\n", model->Text());
  const TrainingSize size = SizeOf(config);
  constexpr double kGigabyte = 1e9;
  if (size.memory > kGigabyte) {
    Say("  up to {:.1f} GB of memory, and {:.1f} GB for the checkpoint on disk\n",
        size.memory / kGigabyte, size.checkpoint / kGigabyte);
  }
  for (const std::string& warning : Warnings(config)) Say("  Warning: {}\n", warning);
  if (since_step_ > 0) Say("  resuming at step {}\n", FormatCount(since_step_));
  std::fflush(stdout);
}

void TrainView::Follow(Training& training) {
  const int64_t steps_in_all = training.config.steps;
  training.on_metrics = [this](const TrainState& s, const AgentReport& report) {
    UpdateRates(s, report);
  };
  training.on_step = [this, steps_in_all](const TrainState& s) {
    if (line_.due()) ShowProgress(s, steps_in_all);
  };
  training.on_evaluation = [this](const TrainState& s, const Evaluation& e) {
    line_.Print(
        fmt::format("{:>9} steps  {:>11}  {:>6} updates/s  eps {:.2f}  loss {:>6}  return {:6.0f}  "
                    "success {:3}/{}",
                    FormatCount(s.steps), FormatDuration(s.seconds), UpdatesText(), report_.epsilon,
                    LossText(), e.reward_sum.mean, e.successes, e.episodes));
  };
}

void TrainView::UpdateRates(const TrainState& s, const AgentReport& report) {
  report_ = report;
  const double elapsed = s.seconds - since_seconds_;
  const bool is_long = elapsed >= 0.5;
  if (elapsed <= 0 || (rates_settled_ && !is_long)) return;
  steps_per_second_ = static_cast<double>(s.steps - since_step_) / elapsed;
  updates_per_second_ = static_cast<double>(report.updates - since_updates_) / elapsed;
  if (!is_long) return;
  rates_settled_ = true;
  since_step_ = s.steps;
  since_updates_ = report.updates;
  since_seconds_ = s.seconds;
}

std::string TrainView::UpdatesText() const {
  return steps_per_second_ > 0 ? FormatCount(updates_per_second_) : "-";
}

void TrainView::ShowProgress(const TrainState& s, int64_t steps_in_all) {
  const auto steps_left = static_cast<double>(steps_in_all - s.steps);
  std::vector<std::string> fields{fmt::format("success {:.0f}%", 100 * s.last_success_rate),
                                  fmt::format("return {:.0f}", s.mean_return())};
  if (steps_per_second_ > 0) {
    fields.insert(fields.begin(),
                  fmt::format("at most {} left", FormatDuration(steps_left / steps_per_second_)));
    fields.push_back(fmt::format("{} steps/s", FormatCount(steps_per_second_)));
    fields.push_back(fmt::format("{} updates/s", UpdatesText()));
  }
  fields.push_back(fmt::format("eps {:.2f}", report_.epsilon));
  fields.push_back("loss " + LossText());
  line_.Show(static_cast<double>(s.steps) / static_cast<double>(steps_in_all), fields);
}

std::string TrainView::LossText() const {
  return report_.updates == 0 ? "-" : fmt::format("{:.4f}", report_.loss);
}

void TrainView::PrintOutcome(const TrainState& s, const TrainConfig& config, bool finished) const {
  const bool did_nothing = begin_step_ > 0 && s.steps == begin_step_ && finished;
  const bool all_steps_done = s.steps >= config.steps;
  if (did_nothing && all_steps_done) {
    Say("Nothing to do: all {} steps were done before (--steps is the total){}.\n",
        FormatCount(config.steps), s.solved ? ", and it is solved" : "");
  } else if (did_nothing) {
    Say("Nothing to do: it was solved before, at step {} after {} of training, and stops when\n"
        "solved. With --no-stop-when-solved it continues to step {} (--steps).\n",
        FormatCount(s.streak_step), FormatDuration(s.streak_seconds), FormatCount(config.steps));
  } else if (s.solved) {
    Say("Solved after {} of training, at step {} (training so far: {}, {} steps).\n",
        FormatDuration(s.streak_seconds), FormatCount(s.streak_step), FormatDuration(s.seconds),
        FormatCount(s.steps));
  } else {
    Say("{} at step {} after {} of training; not solved yet.\n", finished ? "Done" : "Stopped",
        FormatCount(s.steps), FormatDuration(s.seconds));
  }
}

void TrainView::Summarize(const TrainState& s, const TrainConfig& config,
                          const std::filesystem::path& run, bool finished) {
  line_.Clear();
  PrintOutcome(s, config, finished);
  const std::filesystem::path policy = run / "policy.safetensors";
  std::error_code error;
  const bool has_policy = s.best_step > 0 && std::filesystem::exists(policy, error);
  if (has_policy) {
    Say("Best policy: {} (step {}, success {:.0f}%, return {:.0f})\n", Printable(policy.string()),
        FormatCount(s.best_step), 100 * s.best_success_rate, s.best_return);
  } else if (s.best_step > 0) {
    Say("Best policy: of step {}, but {} no longer exists\n", FormatCount(s.best_step),
        Printable(policy.string()));
  }
  if (Printable(run.string()) != run.string()) return;  // such a name cannot be typed
  const std::string folder = ShellQuoted(run.string());
  Say("Next:\n");
  if (has_policy) {
    Say("  ./upswing demo {0}\n  ./upswing eval {0}\n  ./upswing info {0}\n", folder);
  }
  std::string how;
  if (finished && s.solved && config.stop_when_solved) how += " --no-stop-when-solved";
  if (finished && s.steps >= config.steps) how += fmt::format(" --steps {}", 2 * s.steps);
  Say("  ./upswing train --resume {}{}\n", folder, how);
}

}  // namespace upswing
