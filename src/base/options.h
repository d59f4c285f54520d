#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace upswing {

/// A closed range of allowed numbers.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();

  /// Whether the range contains `value`; false for NaN.
  bool Contains(double value) const { return value >= low && value <= high; }
};
inline constexpr Range kPositive{1e-9, 1e9};
inline constexpr Range kNotNegative{0, 1e12};
inline constexpr Range kZeroToOne{0, 1};  // a share or probability

/// The flag of a setting or an alias, such as `--eval-every` for `eval_every`.
std::string FlagOf(std::string name);

/// One setting, as flags, configuration files, help and validation use it.
struct Option {
  /// Effect of a change of the setting.
  enum class Decides {
    kTraining,  // changes the training
    kSeed,      // changes only the random numbers of the training
    kEnd,       // changes only the length of the run
    kNothing,   // changes nothing that the run computes
  };
  using Target = std::variant<bool*, int64_t*, double*, std::string*, std::vector<int64_t>*>;

  std::string section;  // TOML table
  std::string name;     // TOML key; the flag has - in place of _
  Target target;        // variable that holds the value
  Range range;          // allowed values of a number
  std::string unit;     // such as "s"; may be empty
  std::string help;     // a noun phrase or an imperative
  Decides decides = Decides::kTraining;
  std::vector<std::string> choices = {};  // allowed values of a text; empty: any
  double step = 0;                        // a number must be a multiple of it; 0: any number
  std::optional<double> sentinel = {};    // a number outside the range that is allowed, too
  bool wraps = false;                     // a text whose line breaks are blanks
  std::string usual = {};  // default in words, shown in place of the value; may be empty
  // Keeps the copy alive that `target` points into; null: the caller keeps the struct.
  std::shared_ptr<const void> owner = {};

  /// Whether another value makes a different run, which cannot resume this one.
  bool identity() const { return decides == Decides::kTraining || decides == Decides::kSeed; }
  /// The smallest allowed number.
  double lowest() const { return sentinel ? std::min(range.low, *sentinel) : range.low; }
  /// The flag, such as `--eval-every`.
  std::string flag() const { return FlagOf(name); }
  /// The value of a setting that is a double.
  double number() const { return *std::get<double*>(target); }
  /// The value in TOML syntax.
  std::string text() const;
  /// The value as a command-line argument, such as `64,64`.
  std::string plain_text() const;
  /// Flag and value for a shell's command line, such as `--hidden 64,64` or `--no-double`.
  std::string on_command_line() const;
  /// Help line with text, unit, and choices or range, such as `length of a training episode [s]
  /// (0.02 to 10)`.
  std::string about() const;
  /// Help line with the current value as the default: `… [s] (0.02 to 10; default 4)`.
  std::string about_with_default() const;
  /// Description of the allowed values, such as `a number in [0, 1] kg` or `a multiple of 0.02 in
  /// [0, 1] s`.
  std::string expected() const;
  /// Parses and checks `text`, then sets the value. Throws BadInput, whose message begins with
  /// `where` (such as `--gamma` or `FILE:3: gamma`).
  void Set(std::string_view text, const std::string& where) const;
};

/// The settings of one or more components, in the order of their addition. Every component has a
/// `void Describe(Options&)` that changes nothing. Each of its lines names the target, key, range,
/// unit and help of one setting. The default of a setting is the initialiser of its member.
class Options {
 public:
  /// Begins a section; the settings that are added next belong to it.
  void Section(std::string_view section) { section_ = section; }

  // Each Add returns a reference that is valid until the next one.
  /// Adds a switch or a text.
  template <typename T>
  requires std::same_as<T, bool> || std::same_as<T, std::string> Option& Add(
      T* target, std::string_view name, std::string_view help) {
    return AddOption(target, name, {}, "", help);
  }
  /// Adds a number.
  template <typename T>
  requires std::same_as<T, int64_t> || std::same_as<T, double> Option& Add(
      T* target, std::string_view name, Range range, std::string_view unit, std::string_view help) {
    return AddOption(target, name, range, unit, help);
  }
  /// Adds a text that must be one of `choices`.
  Option& AddChoice(std::string* target, std::string_view name, std::vector<std::string> choices,
                    std::string_view help);
  /// Adds a list of integers.
  Option& Add(std::vector<int64_t>* target, std::string_view name, Range range,
              std::string_view help) {
    return AddOption(target, name, range, "", help);
  }

  /// Adds a name that sets several settings, such as `mass` for `mass1` and `mass2`. An empty
  /// `help` becomes "set … and …".
  void Alias(std::string_view name, std::vector<std::string> members, std::string_view help = "");

  /// Keeps the struct alive that the settings added so far point into, as long as they exist.
  void Keep(const std::shared_ptr<const void>& owner) {
    for (Option& option : options_) option.owner = owner;
  }

  /// Adds each setting and explanation of `others` whose name is missing here.
  void AddMissing(const Options& others);

  /// Sets the message with which Find rejects a name that is not a setting.
  void Explain(std::string_view name, std::string_view why);
  /// The message given to Explain for this name; empty if there is none.
  std::string WhyMissing(std::string_view name) const;

  const std::vector<Option>& all() const { return options_; }
  /// The setting called `name`; nullptr if there is none.
  const Option* Get(std::string_view name) const;
  struct AliasEntry {
    std::string section, name;
    std::vector<std::string> members;
    std::string help;
  };
  const std::vector<AliasEntry>& aliases() const { return aliases_; }

  /// The settings that a name or an alias stands for. Throws BadInput with the nearest known name.
  std::vector<const Option*> Find(std::string_view name, const std::string& where) const;

  /// Sets each setting that the name or alias stands for; see Option::Set.
  void Set(std::string_view name, std::string_view text, const std::string& where) const;

  /// The `wanted` settings as a TOML document. With `comments`, each setting has its description.
  std::string Toml(bool comments, const std::function<bool(const Option&)>& wanted) const;

 private:
  Option& AddOption(Option::Target target, std::string_view name, Range range,
                    std::string_view unit, std::string_view help);

  std::string section_;
  std::vector<Option> options_;
  std::vector<AliasEntry> aliases_;
  std::map<std::string, std::string, std::less<>> missing_;  // name → why there is none
};

/// The settings of a struct, as pointers into it.
template <typename Config>
Options OptionsOf(Config& config) {
  Options options;
  config.Describe(options);
  return options;
}

/// The settings of a const struct, for reading: they point into a copy, which they keep alive. Set
/// changes only the copy.
template <typename Config>
Options OptionsOf(const Config& config) {
  const auto copy = std::make_shared<Config>(config);
  Options options = OptionsOf(*copy);
  options.Keep(copy);
  return options;
}

/// A setting whose value differs between two structs.
struct Difference {
  Option now;
  std::optional<Option> before;  // nothing if the other struct lacks the setting
};

/// The settings of `now` that `before` lacks or has with a different value, in the order of `now`.
std::vector<Difference> Differences(const Options& now, const Options& before);

}  // namespace upswing
