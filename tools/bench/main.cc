#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <exception>

#include "base/error.h"
#include "base/simd.h"
#include "base/text.h"
#include "base/thread_pool.h"
#include "cli/program.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "os/machine.h"
#include "os/streams.h"
#include "tools/bench/bench.h"
#include "tools/bench/report.h"

namespace upswing {
namespace {

/// A part of the benchmarks, named as the user types it.
struct BenchPart {
  std::string name, help;
  BenchCases (*cases)(const BenchOptions&);
};

std::vector<BenchPart> Parts() {
  return {
      {"kernels", "layer products, Adam, transposition, memory bandwidth", KernelCases},
      {"gradient", "updates of DQN: sample a minibatch and learn from it", GradientCases},
      {"sac", "updates of SAC: minibatch, two critics, actor, temperature", SacCases},
      {"ppo", "steps of PPO on Pendulum-v1, with two epochs of learning", PpoCases},
      {"act", "actions of a policy", ActCases},
      {"replay", "sampling and adding, with a replay memory of 300,000", ReplayCases},
      {"physics", "Runge-Kutta steps in MuJoCo and in closed form", PhysicsCases},
      {"env", "environment steps: physics, observation, reward, reset", EnvCases},
      {"train", "training steps: environment and agent, without evaluations", TrainCases},
  };
}

/// Passes the cases to Google Benchmark, which calls back several times per case. A signal to stop
/// ends the current measurement and skips all later ones.
class BenchRunner {
 public:
  BenchRunner(const BenchCases& cases, const BenchOptions& options,
              const std::map<int, double>& peak_gflops)
      : cases_(cases),
        options_(options),
        peak_gflops_(peak_gflops),
        reporter_(cases, options, peak_gflops) {}

  void Run() {
    for (const BenchCase& c : cases_) {
      benchmark::RegisterBenchmark(c.name.c_str(),
                                   [this, &c](benchmark::State& state) { Measure(c, state); })
          ->UseRealTime()
          ->MeasureProcessCPUTime()
          ->MinTime(options_.seconds)
          ->Repetitions(static_cast<int>(options_.repetitions));
    }
    benchmark::RunSpecifiedBenchmarks(&reporter_);
    benchmark::ClearRegisteredBenchmarks();
    if (error_) std::rethrow_exception(error_);
  }

  const BenchReporter& reporter() const { return reporter_; }

 private:
  void Measure(const BenchCase& c, benchmark::State& state) {
    if (StopSignal() != 0 || error_) return Stop(state);
    reporter_.ShowProgress(c);
    try {
      if (prepared_ != &c) {
        work_ = nullptr;  // first free the memory of the previous case
        work_ = c.prepare();
        prepared_ = &c;
      }
      for ([[maybe_unused]] auto iteration : state) {
        work_();
        if (StopSignal() == 0) continue;
        Stop(state);
        break;
      }
    } catch (...) {  // no exception may pass through Google Benchmark
      error_ = std::current_exception();
      return Stop(state);
    }
    Count(c, state);
  }

  void Stop(benchmark::State& state) {
    state.SkipWithError("stopped");
    reporter_.Stop();
  }

  /// Adds rates for the JSON file.
  void Count(const BenchCase& c, benchmark::State& state) const {
    const auto calls = static_cast<double>(state.iterations());
    const auto rate = [&](const std::string& name, double amount) {
      state.counters[name] = benchmark::Counter(amount * calls, benchmark::Counter::kIsRate);
    };
    rate("items_per_second", c.count);
    if (c.bytes > 0) rate("bytes_per_second", c.bytes);
    if (c.flops <= 0) return;
    rate("gflops", 1e-9 * c.flops);
    rate("peak_share", 1e-9 * c.flops / peak_gflops_.at(c.threads));
  }

  const BenchCases& cases_;
  const BenchOptions& options_;
  const std::map<int, double>& peak_gflops_;
  BenchReporter reporter_;
  const BenchCase* prepared_ = nullptr;  // case of work_
  BenchWork work_;
  std::exception_ptr error_;
};

/// Throws BadInput if options contradict each other.
void CheckOptions(const BenchOptions& options) {
  const std::vector<std::string> names = NamesOf(Parts());
  for (const std::string& part : options.parts) {
    if (std::ranges::find(names, part) == names.end()) {
      throw BadInput(Concat("bench: expected parts of ", Join(names, ", "), ", got \"", part, "\"",
                            DidYouMean(part, names)));
    }
  }
  const auto runs = [&](const char* part) {
    return options.parts.empty() || std::ranges::find(options.parts, part) != options.parts.end();
  };
  if (!options.network.empty() && !runs("gradient")) {
    throw BadInput("--network: expected the part gradient with it, got other parts");
  }
  if ((!options.hidden.empty() || options.batch > 0) && !runs("gradient") && !runs("sac") &&
      !runs("ppo")) {
    throw BadInput(
        "--hidden, --batch: expected one of the parts gradient, sac and ppo with them, got others");
  }
  if (options.json) CheckWritable("--json", *options.json);
}

BenchCases WantedCases(const BenchOptions& options) {
  BenchCases cases;
  for (const BenchPart& part : Parts()) {
    const auto& wanted = options.parts;
    if (!wanted.empty() && std::ranges::find(wanted, part.name) == wanted.end()) continue;
    for (BenchCase& c : part.cases(options)) {
      c.threads = ResolveThreads(c.threads);
      cases.push_back(std::move(c));
    }
  }
  return cases;
}

int RunBench(BenchOptions options) {
  CheckOptions(options);
  if (!options.simd.empty()) UseSimdPath(options.simd);
  if (options.threads.empty()) options.threads = {1, ResolveThreads(0)};
  std::ranges::sort(options.threads);
  options.threads.erase(std::unique(options.threads.begin(), options.threads.end()),
                        options.threads.end());

  InstallSignalHandlers("");
  const BenchCases cases = WantedCases(options);
  std::map<int, double> peak_gflops;  // by number of threads
  for (const BenchCase& c : cases) {
    double& peak = peak_gflops[c.threads];
    if (c.flops > 0 && peak == 0) peak = MeasurePeakGflops(c.threads);
  }
  std::erase_if(peak_gflops, [](const auto& peak) { return peak.second == 0; });

  BenchRunner runner(cases, options, peak_gflops);
  runner.Run();
  if (StopSignal() != 0) {
    SayError(fmt::format("stopped after {} of {} cases{}", runner.reporter().cases_done(),
                         cases.size(),
                         options.json ? "; " + Printable(*options.json) + " is not written" : ""));
    return 128 + StopSignal();
  }
  if (options.json) WriteOutput(*options.json, runner.reporter().Json());
  return 0;
}

void AddBench(CommandLine& line) {
  BenchOptions& o = line.Runs(RunBench);
  line.Texts("parts", o.parts, "PART", "parts to measure (default all)");
  line.Text("--json", o.json, "FILE",
            "JSON file to write, in the format of Google Benchmark; -: standard output, without "
            "the table");
  Options own;
  own.Add(&o.threads, "threads", {0, 256}, "numbers of threads; 0: chosen by timing").usual =
      "1 and one per processor, at most 8";
  own.AddChoice(&o.simd, "simd", SimdPaths(), "vector instructions to use").usual = "the first";
  own.Add(&o.seconds, "seconds", {0.001, 1000}, "s", "time per repetition of a case");
  own.Add(&o.repetitions, "repetitions", {1, 1000}, "",
          "repetitions of each case; the table shows the median");
  own.AddChoice(&o.network, "network", {"plain", "dueling"},
                "network of gradient: plain DQN or Dueling Double DQN")
      .usual = "both";
  own.Add(&o.hidden, "hidden", {1, 4096}, "widths of the hidden layers of gradient, sac and ppo")
      .usual = "several";
  own.Add(&o.batch, "batch", {1, 65536}, "transitions",
          "size of the minibatches of gradient, sac and ppo")
      .usual = "several";
  line.Arguments(own);

  std::string parts = "Parts:\n";
  for (const BenchPart& part : Parts()) parts += fmt::format("  {:<10}{}\n", part.name, part.help);
  line.Footer(
      parts +
      "\nGFLOP/s counts only the necessary multiplications and additions. The peak is measured\n"
      "first: multiply-adds in registers on the same number of threads. CPU time is the sum\n"
      "over all threads; other load affects it less than wall time.\n\n"
      "Examples:\n"
      "  ./upswing bench                               everything, about two minutes\n"
      "  ./upswing bench gradient train --threads 1,2\n"
      "  ./upswing bench sac --threads 0,1             automatic choice and one thread\n"
      "  ./upswing bench gradient --network plain --hidden 256,256 --json rate.json\n"
      "  ./upswing bench kernels --simd avx2 --seconds 1 --repetitions 5\n");
}

constexpr Command kCommands[] = {{"bench", AddBench}};

}  // namespace
}  // namespace upswing

// An exception during the report of another exception ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  return upswing::MainProgram(argc, argv, upswing::kCommands);
}
