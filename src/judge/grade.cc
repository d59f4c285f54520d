#include "judge/grade.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "agents/arguments.h"
#include "base/csv.h"
#include "base/error.h"
#include "base/simd.h"
#include "base/text.h"
#include "judge/rollout.h"
#include "judge/trial.h"
#include "os/file.h"
#include "runs/find_policy.h"
#include "runs/run_folder.h"
#include "runs/tensor_file.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostEntries = 2000;
// Two million weights, six times the largest named agent. A larger network would hold up the class.
constexpr size_t kMostBytes = 1 << 23;

/// Rounds to a multiple of 2^-20. C libraries differ in the last bits of a logarithm or sine, which
/// this removes.
double OnGrid(double x) { return std::nearbyint(x * 0x1p20) * 0x1p-20; }

PendulumState OnGrid(const PendulumState& s) {
  return {OnGrid(s.q1), OnGrid(s.q2), OnGrid(s.w1), OnGrid(s.w2)};
}

/// A policy with torques on a grid of a millionth of a newton metre.
class GridPolicy : public Policy {
 public:
  explicit GridPolicy(const Policy& policy) : policy_(policy) {}
  std::string kind() const override { return policy_.kind(); }
  std::string description() const override { return policy_.description(); }
  int obs_size() const override { return policy_.obs_size(); }
  int action_size() const override { return policy_.action_size(); }
  const PolicyInfo& info() const override { return policy_.info(); }
  Tensors ToTensors() const override { return policy_.ToTensors(); }
  std::unique_ptr<Memory> Start(int num_envs) const override { return policy_.Start(num_envs); }
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override {
    policy_.Act(obs, action, memory);
    for (double& torque : action.values()) torque = OnGrid(torque);
  }

 private:
  const Policy& policy_;
};

/// The policy file of an entry. Throws BadInput if the entry cannot have one.
fs::path PolicyFile(const fs::path& entry) {
  const auto status = fs::symlink_status(entry);
  fs::path file = entry;
  if (fs::is_directory(status)) file /= RunFolder::kPolicy;
  if (IsOwnFile(file) && file.extension() == ".safetensors") return file;
  const char* got = "no regular file";
  if (fs::is_symlink(status) || fs::is_symlink(file)) {
    got = "a link";
  } else if (fs::is_directory(status)) {
    got = "a folder without it";
  } else if (fs::is_regular_file(status)) {
    got = "another file";
  }
  throw BadInput(Concat("expected NAME.safetensors or NAME/policy.safetensors, got ", got));
}

LoadedPolicy PolicyOfEntry(const fs::path& file) {
  if (fs::file_size(file) > kMostBytes) {
    throw BadInput(Concat("expected at most ", kMostBytes, " bytes, got ", fs::file_size(file)));
  }
  LoadedPolicy loaded = ReadPolicy(LoadTensors(file, kMostBytes));
  ExpectPendulum(loaded);
  return ForOtherSize(loaded, Plant()).value_or(loaded);
}

/// Environments of the built-in plant with the policy's observations, in the closed form: sines and
/// cosines of MuJoCo are those of the C library.
PendulumEnvConfig EnvironmentsFor(const LoadedPolicy& loaded, const GradeConfig& config, double box,
                                  ThreadPool& pool) {
  TrialArguments trial;
  trial.physics = kClosedForm.name;
  trial.seed = config.seed;
  trial.flags = {{"randomize", FormatNumber(box)}};
  PendulumEnvConfig env = TrialEnvironments(trial, &loaded);
  env.plants = {Plant()};
  env.pool = &pool;
  return env;
}

Evaluation Judge(const Policy& policy, PendulumEnvConfig config, int64_t episodes,
                 const Progress& progress) {
  if (episodes == 0) return {};
  config.num_envs = static_cast<int>(episodes);
  PendulumEnv env(config);
  for (int i = 0; i < config.num_envs; ++i) env.SetState(i, OnGrid(env.state(i)));
  Evaluation result = Evaluate(policy, env, config.pool, progress);
  if (std::isfinite(result.reward_sum.mean)) return result;
  throw BadInput("expected torques that are numbers, got others");
}

std::vector<PendulumState> MotionOf(const Policy& policy, const PendulumEnvConfig& config) {
  RolloutConfig rollout;
  rollout.policy = &policy;
  rollout.env = config;
  rollout.start = OnGrid(PendulumEnv(config).state(0));
  std::vector<PendulumState> states;
  for (const RolloutRow& row : RunRollout(rollout).rows) states.push_back(row.state);
  return states;
}

/// Grades an entry. Throws if it cannot be graded.
void GradeEntry(const fs::path& folder, const GradeConfig& config, ThreadPool& pool,
                const Progress& progress, Grade& grade) {
  const fs::path file = PolicyFile(folder / grade.file);
  grade.file = file.lexically_relative(folder).generic_string();
  const LoadedPolicy loaded = PolicyOfEntry(file);
  const GridPolicy policy(*loaded.policy);
  const PendulumEnvConfig nominal = EnvironmentsFor(loaded, config, 0, pool);
  grade.nominal = Judge(policy, nominal, config.episodes, progress);
  grade.random =
      Judge(policy, EnvironmentsFor(loaded, config, kGradeBox, pool), config.plants,
            [&](double part, double) { progress(static_cast<double>(config.episodes) + part, 0); });
  grade.motion = MotionOf(policy, nominal);
}

/// Names entries that have the same name, such as anna.safetensors and the folder anna, by file.
void TellNamesakesApart(std::vector<Grade>& grades) {
  std::map<std::string, int> count;
  for (const Grade& grade : grades) ++count[grade.name];
  for (Grade& grade : grades) {
    if (count[grade.name] > 1) grade.name = grade.file;
  }
}

/// The entries of a folder, in the order of their files.
std::vector<Grade> EntriesOf(const fs::path& folder) {
  std::error_code error;
  std::vector<Grade> grades;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const fs::path file = entry.path().filename();
    if (file.string().starts_with('.')) continue;
    const bool is_policy = file.extension() == ".safetensors";
    grades.push_back({(is_policy ? file.stem() : file).string(), file.string(), "", {}, {}, {}});
    if (grades.size() > kMostEntries) break;
  }
  if (error) throw PathError("cannot read", folder, error.value());
  if (grades.empty() || grades.size() > kMostEntries) {
    throw BadInput(Concat(folder.string(), ": expected 1 to ", kMostEntries,
                          " policies in the folder, got ", grades.empty() ? "none" : "more"));
  }
  std::ranges::sort(grades, {}, &Grade::file);
  TellNamesakesApart(grades);
  return grades;
}

/// A text that a spreadsheet takes for no formula.
std::string NoFormula(const std::string& text) {
  return text.find_first_of("=+-@") == 0 ? "'" + text : text;
}

std::string Decimals(double x) { return fmt::format("{:.2f}", x); }

/// Adds the figures of a grade as texts: `add(name, text)`.
template <typename Add>
void AddFigures(const Grade& grade, const Add& add) {
  const Evaluation& e = grade.nominal;
  add("episodes", Concat(e.episodes));
  add("successes", Concat(e.successes));
  add("return", Decimals(e.reward_sum.mean));
  add("plants", Concat(grade.random.episodes));
  add("plant_successes", Concat(grade.random.successes));
  add("torque_variation", Decimals(e.torque_variation.mean));
  add("energy_used", Decimals(e.work.mean));
}

}  // namespace

// Defined by CMake from judge/grade_page.html.
std::string_view GradePageTemplate();

void GradeConfig::Describe(Options& o) {
  o.Add(&episodes, "episodes", {1, 10000}, "", "number of episodes on the nominal plant");
  o.Add(&plants, "plants", {0, 10000}, "",
        "number of random plants, each with one episode: masses, lengths, dampings and gravity "
        "within ±25% of the nominal plant");
  DescribeSeed(o, &seed, "start states and random plants");
}

std::vector<Grade> GradeFolder(const fs::path& folder, const GradeConfig& config, ThreadPool& pool,
                               const Progress& progress) {
  // Every machine has this path, with the same bits.
  UseSimdPath("portable");
  std::vector<Grade> grades = EntriesOf(folder);
  const double each = static_cast<double>(config.episodes + config.plants);
  const double total = each * static_cast<double>(grades.size());
  double done = 0;
  for (Grade& grade : grades) {
    try {
      GradeEntry(
          folder, config, pool, [&](double part, double) { progress(done + part, total); }, grade);
    } catch (const std::exception& problem) {
      grade.refused = Replaced(problem.what(), (folder / "").string(), "");
    }
    progress(done += each, total);
  }
  std::ranges::stable_sort(grades, {}, [](const Grade& grade) {
    return std::tuple(!grade.refused.empty(), -grade.nominal.successes,
                      -grade.nominal.reward_sum.mean);
  });
  return grades;
}

std::string GradesCsv(const std::vector<Grade>& grades) {
  CsvTable csv;
  for (size_t i = 0; i < grades.size(); ++i) {
    const bool known = grades[i].refused.empty();
    csv.Add("rank", known ? Concat(i + 1) : "");
    csv.Add("name", NoFormula(grades[i].name));
    csv.Add("file", NoFormula(grades[i].file));
    AddFigures(grades[i], [&](std::string_view name, const std::string& text) {
      csv.Add(name, known ? text : "");
    });
    csv.Add("refused", NoFormula(OneLine(grades[i].refused)));
    csv.EndRow();
  }
  return csv.text();
}

std::string GradesPage(const std::vector<Grade>& grades, const GradeConfig& config) {
  nlohmann::ordered_json page;
  page["seed"] = config.seed;
  page["rows"] = nlohmann::ordered_json::array();
  for (const Grade& grade : grades) {
    nlohmann::ordered_json row;
    row["name"] = Printable(grade.name);
    if (!grade.refused.empty()) row["refused"] = OneLine(grade.refused);
    AddFigures(grade, [&](const char* name, const std::string& text) { row[name] = text; });
    // Every second state, in thousandths of a radian.
    auto& motion = row["motion"] = nlohmann::ordered_json::array();
    for (size_t k = 0; k < grade.motion.size(); k += 2) {
      motion.push_back(std::lround(1000 * grade.motion[k].q1));
      motion.push_back(std::lround(1000 * grade.motion[k].q2));
    }
    page["rows"].push_back(std::move(row));
  }
  // In ASCII and without "<", the document cannot end the script element that holds it.
  const std::string json = Replaced(page.dump(-1, ' ', true), "<", "\\u003c");
  return Replaced(std::string(GradePageTemplate()), "@DATA@", json);
}

}  // namespace upswing
