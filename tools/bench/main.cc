#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "base/error.h"
#include "base/simd.h"
#include "base/text.h"
#include "cli/program.h"
#include "os/host.h"
#include "os/streams.h"
#include "tools/bench/bench.h"

namespace upswing {
namespace {

/// Measures a case. The counter is a rate: items per second.
void Measure(benchmark::State& state, const BenchCase& c) {
  const BenchWork work = c.prepare();
  for ([[maybe_unused]] auto iteration : state) work();
  state.counters["items_per_second"] = {c.count * static_cast<double>(state.iterations()),
                                        benchmark::Counter::kIsRate};
}

/// The cases whose names begin as wanted. Throws BadInput if there is none for a name.
BenchCases WantedCases(const BenchOptions& options) {
  BenchCases all;
  for (const auto part : {GradientCases, EnvCases}) {
    std::ranges::move(part(options), std::back_inserter(all));
  }
  const auto begins = [](const BenchCase& c, const std::string& name) {
    return c.name.starts_with(name);
  };
  for (const std::string& name : options.names) {
    if (std::ranges::any_of(all, [&](const BenchCase& c) { return begins(c, name); })) continue;
    throw BadInput(
        Concat("bench: expected beginnings of names of cases, such as gradient or env, got \"",
               name, "\""));
  }
  std::erase_if(all, [&](const BenchCase& c) {
    return !options.names.empty() &&
           std::ranges::none_of(options.names,
                                [&](const std::string& name) { return begins(c, name); });
  });
  return all;
}

/// Gives Google Benchmark its flags.
void Initialize(const BenchOptions& options) {
  static std::string program = "upswing-bench";  // Google Benchmark keeps it
  std::vector<std::string> flags{fmt::format("--benchmark_min_time={}", options.seconds),
                                 fmt::format("--benchmark_repetitions={}", options.repetitions)};
  if (options.repetitions > 1) flags.emplace_back("--benchmark_display_aggregates_only=true");
  if (!options.json.empty() && !IsStandardStream(options.json)) {
    flags.push_back("--benchmark_out=" + options.json);
  }
  std::vector<char*> words{program.data()};
  for (std::string& flag : flags) words.push_back(flag.data());
  int count = static_cast<int>(words.size());
  benchmark::Initialize(&count, words.data());
}

int RunBench(BenchOptions options) {
  if (!options.json.empty()) CheckWritable("--json", options.json);
  if (!options.simd.empty()) UseSimdPath(options.simd);
  if (options.threads.empty()) options.threads = {1, ResolveThreads(0)};
  std::ranges::sort(options.threads);
  options.threads.erase(std::unique(options.threads.begin(), options.threads.end()),
                        options.threads.end());
  const BenchCases cases = WantedCases(options);

  Initialize(options);
  benchmark::AddCustomContext("upswing_version", UPSWING_VERSION);
  benchmark::AddCustomContext("cpu_model", CpuModel());
  benchmark::AddCustomContext("simd_path", SimdPath());
  for (const BenchCase& c : cases) {
    benchmark::RegisterBenchmark(c.name.c_str(), Measure, c)
        ->UseRealTime()
        ->MeasureProcessCPUTime();
  }
  benchmark::JSONReporter json;
  benchmark::ConsoleReporter table(benchmark::ConsoleReporter::OO_Tabular);
  table.SetErrorStream(&std::cout);  // for the context
  benchmark::BenchmarkReporter* display = &table;
  if (IsStandardStream(options.json)) display = &json;
  benchmark::RunSpecifiedBenchmarks(display);
  return 0;
}

void AddBench(CommandLine& line) {
  BenchOptions& o = line.Runs(RunBench);
  line.Texts("cases", o.names, "CASE", "beginnings of the names of cases to measure (default all)");
  line.Text("--json", o.json, "FILE",
            "JSON file to write, in the format of Google Benchmark; -: standard output, without "
            "the table");
  Options own;
  own.Add(&o.threads, "threads", {1, 256}, "numbers of threads").usual =
      "1 and one per processor, at most 8";
  own.AddChoice(&o.simd, "simd", SimdPaths(), "vector instructions to use").usual = "the first";
  own.Add(&o.seconds, "seconds", {0.001, 1000}, "s", "time per repetition of a case");
  own.Add(&o.repetitions, "repetitions", {1, 1000}, "", "repetitions of each case");
  own.Add(&o.hidden, "hidden", {1, 4096}, "widths of the hidden layers of gradient").usual =
      "several";
  own.Add(&o.batch, "batch", {1, 65536}, "transitions", "size of the minibatches of gradient")
      .usual = "several";
  line.Arguments(own);
  line.Footer(
      "Cases:\n"
      "  gradient  updates of DQN: sample a minibatch and learn from it\n"
      "  env       environment steps: physics, observation, reward, reset\n"
      "\nCPU time is the sum over all threads; other load affects it less than wall time.\n\n"
      "Examples:\n"
      "  ./upswing bench                               everything, about half a minute\n"
      "  ./upswing bench gradient env --threads 1,2\n"
      "  ./upswing bench gradient/plain --hidden 256,256 --json rate.json\n"
      "  ./upswing bench gradient --simd avx2 --seconds 1 --repetitions 5\n");
}

constexpr Command kCommands[] = {{"bench", AddBench}};

}  // namespace
}  // namespace upswing

// An exception during the report of another exception ends the program.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  return upswing::MainProgram(argc, argv, upswing::kCommands);
}
