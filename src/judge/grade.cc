#include "judge/grade.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "agents/arguments.h"
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

/// Throws BadInput for a file of more than kMostBytes, which may be a checkpoint.
void CheckSize(const fs::path& file) {
  const auto size = fs::file_size(file);
  if (size <= kMostBytes) return;
  constexpr uint64_t kHeaderOnly = uint64_t{1} << 32;  // a larger file is no checkpoint
  if (size < kHeaderOnly) ExpectNoCheckpoint(LoadPartOfTensors(file, "a prefix of no tensor"));
  throw BadInput(Concat("expected at most ", kMostBytes, " bytes, got ", size));
}

LoadedPolicy PolicyOfEntry(const fs::path& file) {
  CheckSize(file);
  LoadedPolicy loaded = ReadPolicy(LoadTensors(file, kMostBytes));
  ExpectPendulum(loaded);
  return loaded;
}

/// How the plant of a training differs from the built-in one; empty if it does not.
std::string NoteOfPlant(const Plant& plant) {
  constexpr size_t kMost = 4;  // differences in the line
  std::vector<std::string> texts;
  for (const auto& [option, here] : Differences(OptionsOf(plant), OptionsOf(Plant()))) {
    texts.push_back(fmt::format("{} {:.4g} {} (here {:.4g})", option.name, option.number(),
                                option.unit, here->number()));
  }
  if (texts.empty()) return "";
  const size_t more = texts.size() - std::min(texts.size(), kMost);
  texts.resize(texts.size() - more);
  return Concat("trained on another plant: ", Join(texts, ", "),
                more > 0 ? Concat(" and ", more, " more") : "");
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
  const LoadedPolicy own = PolicyOfEntry(file);
  grade.note = NoteOfPlant(own.plant);
  const LoadedPolicy loaded = ForOtherSize(own, Plant()).value_or(own);
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
    Grade grade;
    grade.name = (is_policy ? file.stem() : file).string();
    grade.file = file.string();
    grades.push_back(std::move(grade));
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

/// The order of graded entries, the best first: by successes, then by return.
std::pair<int64_t, double> OrderOf(const Grade& grade) {
  return {-grade.nominal.successes, -grade.nominal.reward_sum.mean};
}

/// Whether two graded entries have the same figures.
bool SameFigures(const Grade& a, const Grade& b) {
  const auto figures = [](const Grade& grade) {
    const Evaluation& e = grade.nominal;
    return std::tuple(OrderOf(grade), e.torque_variation.mean, e.work.mean, grade.random.successes,
                      grade.random.reward_sum.mean);
  };
  return figures(a) == figures(b);
}

/// Adds the first entry with the same file to the notes of the others, or else the first one with
/// the same figures.
void NameCopies(const fs::path& folder, std::vector<Grade>& grades) {
  const auto content = [&](const Grade& grade) {
    return ReadOwnBytes(folder / grade.file, kMostBytes);
  };
  for (auto grade = grades.begin(); grade != grades.end() && grade->refused.empty(); ++grade) {
    const auto same_figures = [&](const Grade& other) { return SameFigures(other, *grade); };
    const auto same_file = [&](const Grade& other) {
      return same_figures(other) && content(other) == content(*grade);
    };
    std::string copy;
    if (const auto first = std::find_if(grades.begin(), grade, same_file); first != grade) {
      copy = "the same file as " + first->name;
    } else if (const auto alike = std::find_if(grades.begin(), grade, same_figures);
               alike != grade) {
      copy = "the same figures as " + alike->name;
    }
    if (copy.empty()) continue;
    grade->note = grade->note.empty() ? copy : Concat(copy, "; ", grade->note);
  }
}

/// Ranks graded entries that are sorted. As in sports, two first ones are followed by a third.
void SetRanks(std::vector<Grade>& grades) {
  for (size_t i = 0; i < grades.size() && grades[i].refused.empty(); ++i) {
    const bool tie = i > 0 && OrderOf(grades[i]) == OrderOf(grades[i - 1]);
    grades[i].rank = tie ? grades[i - 1].rank : static_cast<int>(i) + 1;
  }
}

}  // namespace

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
    return std::tuple(!grade.refused.empty(), OrderOf(grade));
  });
  SetRanks(grades);
  NameCopies(folder, grades);
  return grades;
}

}  // namespace upswing
