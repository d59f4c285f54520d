#include <toml++/toml.h>

#include <algorithm>
#include <map>

#include "agents/toml_settings.h"
#include "base/error.h"
#include "base/text.h"
#include "runs/config_files.h"
#include "runs/seeds.h"
#include "runs/study_plan.h"

namespace upswing {
namespace {

/// Reads and checks the settings of one table of the study.
std::vector<FlagValue> ReadSettings(const toml::node& node, const std::string& name,
                                    const std::string& where) {
  const auto* table = node.as_table();
  const std::string place = PlaceOf(node, where);
  if (table == nullptr) throw BadInput(Concat(place, ": ", name, ": expected a table of settings"));
  // The copies of all settings take the values, which checks them.
  std::vector<FlagValue> settings = ApplyTable(EverySetting(), *table, where, true);
  for (const FlagValue& setting : settings) {
    if (setting.name == "seed") {
      throw BadInput(Concat(setting.where,
                            ": expected no seed in the settings; a line seeds = … at the ",
                            "beginning of the file sets the seeds"));
    }
  }
  return settings;
}

/// Builds the settings of a variant and checks them together. Throws BadInput.
Config BuildVariant(const std::string& name, const std::vector<FlagValue>& settings,
                    const std::string& place, const std::string& where) {
  try {
    return BuildConfig("", settings);
  } catch (const Error& error) {
    const std::string_view what = error.what();
    if (what.starts_with(where)) throw;  // the message already has the line
    throw BadInput(Concat(place, ": variant \"", name, "\": ", what));
  }
}

/// Reads the variants in the order of the file.
std::vector<Variant> ReadVariants(const toml::table& study, const std::string& where) {
  std::vector<FlagValue> common;
  if (const toml::node* node = study.get("settings")) {
    common = ReadSettings(*node, "settings", where);
  }
  const auto* variants = study["variants"].as_table();
  if (variants == nullptr || variants->empty()) {
    throw BadInput(Concat(where, ": expected at least one variant: a table [variants.NAME]"));
  }
  if (variants->size() > kMostVariants) {
    throw BadInput(
        Concat(where, ": expected at most ", kMostVariants, " variants, got ", variants->size()));
  }
  struct Placed {
    uint32_t line;
    Variant variant;
  };
  struct Known {
    uint32_t line;
    std::string name;
  };
  std::vector<Placed> placed;
  std::map<std::string, Known> known;  // by the settings
  for (const auto& [key, node] : *variants) {
    const std::string name(key.str());
    CheckVariantName(name, PlaceOf(node, where));
    std::vector<FlagValue> settings = common;
    const std::vector<FlagValue> own = ReadSettings(node, name, where);
    settings.insert(settings.end(), own.begin(), own.end());
    Variant variant{name, BuildVariant(name, settings, PlaceOf(node, where), where)};
    MakeReadyForMany(variant.config);
    const uint32_t line = node.source().begin.line;
    const auto [same, is_new] =
        known.try_emplace(ConfigToml(variant.config, true), Known{line, name});
    if (!is_new) {
      throw BadInput(Concat(PlaceOf(node, where), ": variant \"", name,
                            "\": expected settings of its own, got those of \"", same->second.name,
                            "\" in line ", same->second.line));
    }
    placed.push_back({line, std::move(variant)});
  }
  std::ranges::stable_sort(placed, {}, &Placed::line);
  std::vector<Variant> in_order;
  in_order.reserve(placed.size());
  for (Placed& entry : placed) in_order.push_back(std::move(entry.variant));
  return in_order;
}

void CheckKeys(const toml::table& study, const std::string& where) {
  const std::vector<std::string> known{"title", "seeds", "keep", "settings", "variants"};
  for (const auto& [key, node] : study) {
    const std::string name(key.str());
    if (std::ranges::find(known, name) != known.end()) continue;
    const bool is_setting = std::ranges::any_of(
        EverySetting().all(), [&](const Option& option) { return option.name == name; });
    if (is_setting && name != "seed") {
      throw BadInput(Concat(PlaceOf(node, where), ": ", name,
                            ": expected in [settings] or [variants.NAME], ",
                            "got at the beginning of the file"));
    }
    throw BadInput(Concat(PlaceOf(node, where), ": expected one of ", Join(known, ", "), ", got \"",
                          name, "\"", DidYouMean(name, known)));
  }
}

/// The text of a top-level key; empty if the key is missing.
std::string ReadText(const toml::table& study, const std::string& key, const std::string& where) {
  const toml::node* node = study.get(key);
  if (node == nullptr) return "";
  const auto text = TextOf(*node);
  if (!text || (key != "seeds" && !node->is_string())) {
    throw BadInput(Concat(PlaceOf(*node, where), ": ", key, ": expected a text",
                          key == "seeds" ? ", a number or a list of numbers" : ""));
  }
  return *text;
}

}  // namespace

StudyPlan ParseStudy(std::string_view text, const std::string& where, Keep keep) {
  const toml::table table = ParseToml(text, where);
  CheckKeys(table, where);
  StudyPlan study{"", ReadText(table, "title", where), ReadVariants(table, where), {}, keep};
  if (const toml::node* kept = table.get("keep")) {
    study.keep = ParseKeep(ReadText(table, "keep", where), Concat(PlaceOf(*kept, where), ": keep"));
  }
  const std::string seeds = ReadText(table, "seeds", where);
  if (!seeds.empty()) {
    study.seeds = ParseSeeds(seeds, Concat(PlaceOf(*table.get("seeds"), where), ": seeds"));
  }
  return study;
}

}  // namespace upswing
