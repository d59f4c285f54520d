#include "runs/study_plan.h"

#include <algorithm>
#include <array>

#include "base/error.h"
#include "base/json.h"
#include "base/text.h"
#include "os/file.h"
#include "runs/config_files.h"
#include "runs/run_folder.h"
#include "runs/seeds.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::array kKeeps{"all", "policy", "tables"};  // in the order of Keep
constexpr size_t kMostPlanBytes = 1 << 24;

}  // namespace

Keep ParseKeep(std::string_view text, const std::string& where) {
  const auto* found = std::ranges::find(kKeeps, text);
  if (found != kKeeps.end()) return static_cast<Keep>(found - kKeeps.begin());
  throw BadInput(Concat(where, ": expected all, policy or tables, got \"", text, "\""));
}

int64_t SeedRun::Steps() const {
  if (finished) return state->steps;
  const int64_t at_checkpoint = state ? state->steps : 0;
  // Each row begins with its step. The last row may be incomplete, so use the one before.
  const std::string tail = ReadEnd(path / RunFolder::kMetrics, 1024);
  const std::vector<std::string_view> rows = Split(tail, '\n');
  if (rows.size() < 3) return at_checkpoint;
  const auto at_metrics = ParseInteger(Split(rows[rows.size() - 2], ',').front());
  return std::max(at_checkpoint, at_metrics.value_or(0));
}

bool SeedRun::HasFailed() const {
  std::error_code error;
  return fs::exists(fs::symlink_status(failed(), error));
}

void SeedRun::Read() {
  CheckNoLink(path);
  problem.clear();
  if (HasFailed()) {
    problem = std::string(Trim(ReadOwnFile(failed(), 1 << 16)));
    if (problem.empty()) problem = "failed";
  }
  state.reset();
  const auto result = FinishedRun::Read(done());
  if (result && result->settings != settings) {
    throw BadInput(Concat(done().string(), ": expected the settings of ",
                          (path.parent_path() / kSettingsName).string(), ", got others"));
  }
  if (result) state = result->state;
  finished = AtEnd();
  if (finished) return;
  state.reset();  // a state with fewer steps than now planned
  if (!IsReduced()) state = ReadTrainState(path, variant->config.Spec());
}

void SeedRun::Refresh() {
  try {
    Read();
  } catch (const Error& error) {
    problem = error.what();
  }
}

void SeedRun::WriteFailed(const std::string& why) const {
  WriteFileAtomically(failed(), Concat(Printable(why), "\n"));
}

bool SeedRun::IsReduced() const {
  return fs::exists(done()) && !fs::exists(path / RunFolder::kCheckpoint);
}

std::vector<SeedRun> RunsOf(const StudyPlan& plan) {
  std::vector<std::string> settings;
  for (const Variant& variant : plan.variants) settings.push_back(SettingsMark(variant.config));
  std::vector<SeedRun> runs;
  runs.reserve(plan.seeds.size() * plan.variants.size());
  for (const int64_t seed : plan.seeds) {
    for (size_t v = 0; v < plan.variants.size(); ++v) {
      const Variant& variant = plan.variants[v];
      const fs::path name = fs::path(variant.name) / Concat("seed", seed);
      runs.push_back({&variant, settings[v], seed, name.string(), plan.folder / name, {}, ""});
    }
  }
  return runs;
}

void WritePlan(const StudyPlan& plan) {
  ordered_json variants = ordered_json::array();
  for (const Variant& variant : plan.variants) {
    const fs::path folder = plan.folder / variant.name;
    MakeFolder(folder);
    const auto wanted = [](const Option& option) {
      return option.decides != Option::Decides::kSeed;
    };
    WriteIfOther(folder / kSettingsName, OptionsOf(variant.config).Toml(true, wanted));
    variants.push_back({{"name", variant.name}, {"settings", SettingsMark(variant.config)}});
  }
  const ordered_json j{{"version", UPSWING_VERSION},
                       {"title", plan.title},
                       {"keep", kKeeps.at(static_cast<size_t>(plan.keep))},
                       {"seeds", Concat("[", SeedsText(plan.seeds), "]")},
                       {"variants", variants}};
  WriteIfOther(plan.folder / kPlanName, PrintableJson(j) + "\n");
}

StudyPlan PlanIn(const json& j, std::vector<std::string>& marks) {
  StudyPlan plan;
  if (j.contains("title")) plan.title = JsonText(j, "title");  // not in plans of 0.5.0
  plan.keep = ParseKeep(JsonText(j, "keep"), "keep");
  plan.seeds = ParseSeeds(JsonText(j, "seeds"), "seeds");
  for (const json& one : JsonList(j, "variants", kMostVariants)) {
    if (!one.is_object()) throw BadInput("variants: expected a list of objects");
    const std::string& name = JsonText(one, "name");
    if (!name.empty()) CheckVariantName(name, "variants");
    if (std::ranges::find(plan.variants, name, &Variant::name) != plan.variants.end()) {
      throw BadInput(Concat("variants: expected each name once, got ", name, " twice"));
    }
    plan.variants.push_back({name, Config()});
    marks.push_back(JsonText(one, "settings"));
  }
  return plan;
}

StudyPlan ReadPlan(const fs::path& folder) {
  const fs::path path = folder / kPlanName;
  const std::string where = path.string();
  if (!Exists(path)) {
    throw BadInput(Concat(folder.string(), ": expected the folder of a study, got ",
                          Exists(folder) ? Concat("one without ", kPlanName) : "no such folder"));
  }
  StudyPlan plan;
  try {
    const json j = ParseJsonObject(ReadOwnFile(path, kMostPlanBytes), 4);
    if (JsonText(j, "version") != UPSWING_VERSION) {
      throw BadInput(Concat("expected a study of Upswing ", UPSWING_VERSION, ", got one of ",
                            JsonText(j, "version"), ", which may train differently"));
    }
    std::vector<std::string> marks;
    plan = PlanIn(j, marks);
    plan.folder = folder;
    for (size_t v = 0; v < marks.size(); ++v) {
      Variant& variant = plan.variants[v];
      CheckNoLink(folder / variant.name);
      const fs::path settings = folder / variant.name / kSettingsName;
      variant.config = ReadSettings(settings);
      MakeReadyForMany(variant.config);
      if (SettingsMark(variant.config) == marks[v]) continue;
      throw BadInput(Concat(settings.string(), ": expected the settings of ", kPlanName,
                            ", got others; `upswing study` writes both"));
    }
  } catch (const Error& broken) {
    const std::string_view what = broken.what();
    if (what.starts_with(folder.string())) throw;
    throw BadInput(Concat(where, ": ", what));
  }
  return plan;
}

std::optional<StudyPlan> PlanBefore(const fs::path& folder) {
  try {
    std::vector<std::string> marks;
    return PlanIn(ParseJsonObject(ReadOwnFile(folder / kPlanName, kMostPlanBytes), 4), marks);
  } catch (const Error&) {
    return std::nullopt;
  }
}

void WriteEvaluations(const StudyPlan& plan) {
  std::string columns, table;
  for (const SeedRun& run : RunsOf(plan)) {
    const auto result = FinishedRun::Read(run.done());
    if (!result) continue;
    bool is_first = true;
    for (std::string_view rest = result->evaluations; !rest.empty();) {
      const std::string_view line = TakeLine(rest);
      if (line.empty()) continue;
      if (!is_first) {
        table += Concat(run.variant->name, ',', run.seed, ',', Printable(line), '\n');
      } else if (columns.empty()) {
        columns = Printable(line);
      } else if (columns != Printable(line)) {
        throw Failure(
            Concat(run.done().string(),
                   ": expected evaluations with the columns of the other runs, got others"));
      }
      is_first = false;
    }
  }
  WriteFileAtomically(plan.folder / "evaluations.csv",
                      Concat("variant,seed,", columns, "\n", table));
}

void CheckVariantName(const std::string& name, const std::string& place) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  };
  if (name.empty() || !std::ranges::all_of(name, fits)) {
    throw BadInput(
        Concat(place, ": expected a name of letters, digits, - and _, got \"", name, "\""));
  }
  constexpr size_t kLongest = 100;  // file names are shorter than 255 bytes
  if (name.size() > kLongest) {
    throw BadInput(
        Concat(place, ": expected a name of at most ", kLongest, " letters, got ", name.size()));
  }
}

}  // namespace upswing
