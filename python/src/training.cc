// Trainings controlled from Python, in a run folder or in memory.
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <string_view>

#include "agents/config_checks.h"
#include "base/safetensors.h"
#include "os/host.h"
#include "python/src/bindings.h"
#include "runs/config_files.h"
#include "runs/find_policy.h"
#include "runs/run_folder.h"
#include "runs/this_host.h"
#include "runs/training_run.h"

namespace upswing {
namespace {

namespace nb = nanobind;

using PolicyPointer = std::shared_ptr<PolicyHandle>;

/// A table row as a dictionary; counters become int, and `terminated` becomes bool.
nb::dict ToDict(const Row& row) {
  constexpr std::array<std::string_view, 4> kCounts{"step", "episode", "episodes", "length"};
  nb::dict d;
  for (const auto& [name, value] : row) {
    if (name == "terminated") {
      d[name.c_str()] = value != 0;
    } else if (std::ranges::find(kCounts, name) != kCounts.end()) {
      d[name.c_str()] = static_cast<int64_t>(value);
    } else {
      d[name.c_str()] = value;
    }
  }
  return d;
}

/// A separate copy of a policy, as its file would store it.
PolicyPointer CopyOf(const Policy& policy, const std::string& name) {
  LoadedPolicy loaded =
      ReadPolicy(ReadSafetensors(WriteSafetensors(policy.ToTensors()).Joined(), name));
  return std::make_shared<PolicyHandle>(std::move(loaded));
}

/// Calls Python's `tick` during a training: after a step with events, and every tenth of a second.
/// The training stops if it returns False.
class PythonDriver final : public TrainObserver {
 public:
  explicit PythonDriver(nb::callable tick) : tick_(std::move(tick)) {}

  void Begin(const Training& training) { training_ = &training; }
  /// The exception in Python that stopped the training.
  std::exception_ptr error() const { return error_; }
  /// Whether that exception is KeyboardInterrupt.
  bool interrupted() const { return interrupted_; }
  const PolicyPointer& best() const { return best_; }

  void OnEpisode(const TrainState& s, const FinishedEpisode& episode) override {
    events_.emplace_back("episode", EpisodeRow(s, episode, training_->spec()));
  }
  void OnMetrics(const TrainState& s, const Metrics& metrics) override {
    events_.emplace_back("metrics", MetricsRow(s, metrics));
  }
  void OnEvaluation(const TrainState& s, const Evaluation& e) override {
    events_.emplace_back("evaluation", EvaluationCells(s, e));
  }
  void OnBest(const TrainState& s, const Policy& policy) override {
    best_ = CopyOf(policy, "the best policy of this training");
    events_.emplace_back("best", Row{{"step", s.steps}});
  }

  /// Tells the events after the last Poll, such as the last evaluation.
  void TellRest() {
    if (!events_.empty() && !error_) Poll();
  }

  TrainRequest Poll() {
    constexpr std::chrono::milliseconds kBetween(100);
    const auto now = std::chrono::steady_clock::now();
    if (events_.empty() && now - last_ < kBetween) return TrainRequest::kGoOn;
    last_ = now;
    // After an exception the training must end in order, with its checkpoint.
    try {
      if (Tell()) return TrainRequest::kGoOn;
    } catch (const nb::python_error& error) {
      const nb::gil_scoped_acquire lock;
      interrupted_ = error.matches(PyExc_KeyboardInterrupt);
      error_ = std::current_exception();
    } catch (...) {
      error_ = std::current_exception();
    }
    return TrainRequest::kStop;
  }

 private:
  bool Tell() {
    const TrainState& s = training_->state();
    const nb::gil_scoped_acquire lock;
    CheckSignals();
    nb::list events;
    for (const auto& [kind, row] : events_) {
      events.append(nb::make_tuple(kind, kind == "best" ? nb::cast(best_) : ToDict(row)));
    }
    events_.clear();
    nb::dict state;
    state["steps"] = s.steps;
    state["total_steps"] = training_->config().train.steps;
    state["episodes"] = s.episodes;
    state["updates"] = training_->agent().updates();
    state["seconds"] = s.seconds;
    state["mean_return"] = s.mean_return();
    state["success_rate"] = s.last_success_rate;
    return nb::cast<bool>(tick_(events, state));
  }

  nb::callable tick_;
  const Training* training_ = nullptr;
  std::vector<std::pair<std::string, Row>> events_;
  PolicyPointer best_;
  std::exception_ptr error_;
  bool interrupted_ = false;
  std::chrono::steady_clock::time_point last_{};
};

/// The result of a training.
nb::dict ResultOf(const Training& training, bool finished, const std::string& path,
                  const PolicyPointer& last, const PolicyPointer& best) {
  const TrainState& s = training.state();
  nb::dict d;
  d["finished"] = finished;
  d["solved"] = s.solved;
  d["solved_step"] = s.solved ? nb::cast(s.streak_step) : nb::none();
  d["solved_seconds"] = s.solved ? nb::cast(s.streak_seconds) : nb::none();
  d["steps"] = s.steps;
  d["episodes"] = s.episodes;
  d["updates"] = training.agent().updates();
  d["seconds"] = s.seconds;
  d["best_step"] = s.best_step > 0 ? nb::cast(s.best_step) : nb::none();
  d["best_success_rate"] = s.best_step > 0 ? nb::cast(s.best_success_rate) : nb::none();
  d["best_return"] = s.best_step > 0 ? nb::cast(s.best_return) : nb::none();
  d["agent"] = training.config().agent;
  d["seed"] = training.config().train.seed;
  d["threads"] = training.threads();
  d["path"] = path.empty() ? nb::none() : nb::cast(path);
  d["config"] = ConfigToml(training.config(), false);
  d["last"] = last;
  d["best"] = best;
  return d;
}

/// A new or resumed training that needs no Python.
struct Driven {
  std::unique_ptr<TrainingRun> run;    // in a folder, or else
  std::unique_ptr<Training> training;  // in memory
  bool finished = false;

  const Training& its() const { return run ? run->training() : *training; }

  /// `waits`: the training waits for each evaluation, because Python may stop it at a step.
  void Train(PythonDriver& driver, bool waits) {
    if (waits && run) run->WaitForEvaluations();
    if (waits && training) training->WaitForEvaluations();
    driver.Begin(its());
    if (run) {
      finished = run->Train(driver, [&] { return driver.Poll(); });
      return;
    }
    training->AddObserver(driver);
    while (training->Step() && driver.Poll() != TrainRequest::kStop) continue;
    training->FinishEvaluation();
    finished = training->trainer().finished();
  }
};

/// Makes the training. Calls `about` with the settings before anything is written.
Driven Make(const std::vector<FlagValue>& flags, const std::string& config_file,
            const std::string& out, const std::string& resume, const ForeignMaker& make_foreign,
            const std::function<void(const Config&)>& about) {
  Driven driven;
  if (!resume.empty()) {
    driven.run = TrainingRun::Resume(resume, flags, make_foreign);
    about(driven.its().config());
    return driven;
  }
  Config config = BuildConfig(config_file, flags);
  about(config);
  if (!out.empty()) {
    driven.run = TrainingRun::Make(out, std::move(config), make_foreign);
    return driven;
  }
  const std::shared_ptr<const Policy> start = StartPolicy(config);
  const int threads = ResolveThreads(config.train.threads);
  driven.training = std::make_unique<Training>(std::move(config), ThisHost(threads, make_foreign));
  if (start) driven.training->StartFrom(*start, "start_policy");
  return driven;
}

nb::dict Train(const SettingTexts& settings, const std::string& config, const std::string& out,
               const std::string& resume, const nb::object& make_foreign, const nb::callable& tick,
               const nb::callable& warn, bool may_stop) {
  const std::vector<FlagValue> flags = FlagsOf(settings);
  PythonDriver driver(tick);
  const auto warn_about = [&](const Config& settings_now) {
    const std::vector<std::string> lines = Warnings(settings_now);
    const nb::gil_scoped_acquire lock;
    for (const std::string& line : lines) warn(line);
  };
  const ForeignMaker maker = MakerOf(make_foreign);
  Driven driven;
  PolicyPointer last, best;
  {
    const nb::gil_scoped_release unlocked;
    driven = Make(flags, config, out, resume, maker, warn_about);
    driven.Train(driver, may_stop);
    driver.TellRest();
    if (driver.error() && !driver.interrupted()) std::rethrow_exception(driver.error());
    last = CopyOf(*driven.its().policy(), "the last policy of this training");
    best = driver.best();
    // A resumed run may have its best policy from an earlier part.
    if (!best && driven.run && driven.its().state().best_step > 0) {
      best = std::make_shared<PolicyHandle>(LoadPolicy(driven.run->path()));
    }
  }
  nb::dict result = ResultOf(driven.its(), driven.finished,
                             driven.run ? driven.run->path().string() : "", last, best);
  result["interrupted"] = driver.interrupted();
  return result;
}

}  // namespace

void BindTraining(nb::module_& m) {
  m.def("train", &Train, nb::arg("settings"), nb::arg("config"), nb::arg("out"), nb::arg("resume"),
        nb::arg("make_foreign").none(), nb::arg("tick"), nb::arg("warn"), nb::arg("may_stop"));
}

}  // namespace upswing
