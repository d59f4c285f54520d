// A study: variants of the settings, each trained with many seeds.
#include <toml++/toml.h>

#include <algorithm>
#include <memory>

#include "apps/commands.h"
#include "apps/compare.h"
#include "apps/many_runs.h"
#include "apps/seeds.h"
#include "apps/toml_settings.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "report/figure.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// What was typed.
struct StudyArguments {
  std::string file, out, seeds;
  int jobs = 0;  // 0: as many as there are processors
};

/// The settings of one table of the study, checked; a model's file counts from the study's folder.
std::vector<FlagValue> ReadSettings(const toml::node& node, const std::string& name,
                                    const std::string& where) {
  const auto* table = node.as_table();
  const std::string place = PlaceOf(node, where);
  if (table == nullptr) throw BadInput(Concat(place, ": ", name, ": expected a table of settings"));
  Config scratch;  // takes the values, which shows whether they can be
  std::vector<FlagValue> settings = ApplyTable(OptionsOf(scratch), *table, where, true);
  for (FlagValue& setting : settings) {
    if (setting.name == "seed") {
      throw BadInput(Concat(setting.where, ": expected no seed among the settings, but \"seeds = ",
                            "…\" at the beginning"));
    }
    if (setting.name == "model" && !setting.text.empty()) {
      setting.text = (fs::path(where).parent_path() / setting.text).string();
    }
  }
  return settings;
}

/// A folder is called after the variant, so its name is made of letters, digits, - and _.
void CheckName(const std::string& name, const std::string& place) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  };
  if (name.empty() || !std::ranges::all_of(name, fits)) {
    throw BadInput(
        Concat(place, ": expected a name of letters, digits, - and _, got \"", name, "\""));
  }
}

/// The variants in the order in which they stand in the file.
std::vector<Variant> ReadVariants(const toml::table& study, const std::string& where) {
  std::vector<FlagValue> common;
  if (const toml::node* node = study.get("settings")) {
    common = ReadSettings(*node, "settings", where);
  }
  const auto* variants = study["variants"].as_table();
  if (variants == nullptr || variants->empty()) {
    throw BadInput(Concat(where, ": expected at least one variant: a table [variants.NAME]"));
  }
  std::vector<std::pair<uint32_t, Variant>> placed;
  for (const auto& [key, node] : *variants) {
    const std::string name(key.str());
    CheckName(name, PlaceOf(node, where));
    std::vector<FlagValue> settings = common;
    const std::vector<FlagValue> own = ReadSettings(node, name, where);
    settings.insert(settings.end(), own.begin(), own.end());
    Variant variant{name, BuildConfig("", settings)};
    MakeReadyForMany(variant.config);
    for (const auto& [line, other] : placed) {
      if (ConfigToml(other.config, true) == ConfigToml(variant.config, true)) {
        throw BadInput(Concat(PlaceOf(node, where), ": variant \"", name,
                              "\" has the settings of \"", other.name, "\" in line ", line,
                              "; expected other ones"));
      }
    }
    placed.emplace_back(node.source().begin.line, std::move(variant));
  }
  std::ranges::stable_sort(placed, {}, [](const auto& entry) { return entry.first; });
  std::vector<Variant> in_order;
  in_order.reserve(placed.size());
  for (auto& [line, variant] : placed) in_order.push_back(std::move(variant));
  return in_order;
}

void CheckKeys(const toml::table& study, const std::string& where) {
  const std::vector<std::string> known{"title", "seeds", "settings", "variants"};
  for (const auto& [key, node] : study) {
    const std::string name(key.str());
    if (std::ranges::find(known, name) != known.end()) continue;
    throw BadInput(Concat(PlaceOf(node, where), ": a study has no \"", name, "\"",
                          DidYouMean(name, known), "; there are ", Join(known, ", ")));
  }
}

/// The text of a key at the beginning of the file; empty if it is not there.
std::string ReadText(const toml::table& study, const std::string& key, const std::string& where) {
  const toml::node* node = study.get(key);
  if (node == nullptr) return "";
  const auto text = TextOf(*node);
  if (!text || (key == "title" && !node->is_string())) {
    throw BadInput(Concat(PlaceOf(*node, where), ": ", key, ": expected a text",
                          key == "title" ? "" : ", a number or a list of numbers"));
  }
  return *text;
}

/// Throws if the folder is that of another study, which this one would take the place of: it has
/// another title, or a variant that this one has not. (TrainMany tells of other settings.)
void CheckSameStudy(const ManyRuns& plan, const std::string& title) {
  const fs::path file = plan.folder / plan.mark.first;
  const std::string where = file.string();
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return;
  const toml::table before = ParseToml(ReadTextFile(file), where);
  const std::string old_title = ReadText(before, "title", where);
  if (old_title != title) {
    throw BadInput(Concat(where, ": made with title \"", old_title, "\", but the study says \"",
                          title, "\"; choose another --out"));
  }
  const auto* variants = before["variants"].as_table();
  if (variants == nullptr) return;
  for (const auto& [key, node] : *variants) {
    if (std::ranges::find(plan.variants, key.str(), &Variant::name) != plan.variants.end())
      continue;
    throw BadInput(Concat(where, ": made with a variant \"", key.str(),
                          "\", which the study has not; choose another --out"));
  }
}

ManyRuns ReadStudy(const StudyArguments& arguments) {
  const fs::path file = arguments.file;
  const std::string where = file.string();
  const std::string text = ReadTextFile(file);
  const toml::table study = ParseToml(text, where);
  CheckKeys(study, where);

  ManyRuns plan;
  const std::string title = ReadText(study, "title", where);
  plan.what = title.empty() ? file.stem().string() : Concat("\"", title, "\"");
  plan.folder = arguments.out.empty() ? fs::path("runs") / file.stem() : fs::path(arguments.out);
  plan.mark = {"study.toml", text};
  plan.variants = ReadVariants(study, where);
  plan.more_steps = plan.compared = true;
  CheckSameStudy(plan, title);
  const std::string seeds = ReadText(study, "seeds", where);
  if (!arguments.seeds.empty()) {
    plan.seeds = ParseSeeds(arguments.seeds, "--seeds");
  } else if (!seeds.empty()) {
    plan.seeds = ParseSeeds(seeds, Concat(PlaceOf(*study.get("seeds"), where), ": seeds"));
  } else {
    throw BadInput(Concat(where, ": expected \"seeds = 10\" or the like, or --seeds"));
  }
  plan.jobs = arguments.jobs;
  if (plan.jobs == 0) plan.jobs = DefaultJobs(plan.variants.front().config.train.threads);
  return plan;
}

int RunStudy(const StudyArguments& arguments) {
  const ManyRuns plan = ReadStudy(arguments);
  CheckCanDraw();  // not only after hours of training
  const int exit_code = TrainMany(plan);
  if (exit_code != 0) return exit_code;
  // All runs are done: what do they show?
  CompareRequest request;
  request.root = plan.folder;
  request.different_tasks = true;
  for (const Variant& variant : plan.variants) {
    for (const int64_t seed : plan.seeds) {
      request.paths.push_back(plan.folder / ManyRuns::NameOf(variant, seed));
    }
  }
  const Comparison comparison = Compare(request);
  WriteComparison(comparison, plan.folder);
  PrintComparison(comparison, plan.folder);
  return 0;
}

}  // namespace

void AddStudy(CLI::App& program, Command& command) {
  CLI::App* app =
      program.add_subcommand("study", "Train variants of the settings, many seeds each");
  auto arguments = std::make_shared<StudyArguments>();
  app->add_option("file", arguments->file, "what to train: variants, settings, seeds")
      ->type_name("FILE.toml")
      ->required()
      ->check(NotEmpty());
  app->add_option("--out", arguments->out, "folder of the study [runs/FILE]")
      ->type_name("FOLDER")
      ->check(NotEmpty());
  AddManyOptions(*app, arguments->seeds, arguments->jobs);
  app->footer(
      "A study file:\n"
      "  title = \"What does layer normalisation do?\"\n"
      "  seeds = 10                   # 1 to 10, or \"3,5,8-12\"\n"
      "  [settings]                   # of all variants, as in a configuration file\n"
      "  agent = \"d3qn-small\"\n"
      "  steps = 300000\n"
      "  [variants.with]\n"
      "  [variants.without]\n"
      "  layer_norm = false\n"
      "\nExamples:\n"
      "  ./upswing study configs/studies/post.toml\n"
      "  ./upswing study configs/studies/post.toml --seeds 3 --out runs/short\n"
      "\nEach run lies in FOLDER/VARIANT/seedN, what it prints in FOLDER/VARIANT/seedN.log. The\n"
      "same command goes on where it was stopped, or killed; finished runs are left alone.\n"
      "Exit code 0: done; 1: a run failed; 2: bad usage or input; 130, 143: stopped.\n");
  app->callback([arguments, &command] { command = [arguments] { return RunStudy(*arguments); }; });
}

}  // namespace upswing
