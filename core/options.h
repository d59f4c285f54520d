#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace upswing {

/// A closed range of allowed numbers.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();

  /// False for NaN.
  bool Contains(double value) const { return value >= low && value <= high; }
};
inline constexpr Range kPositive{1e-9, 1e9};
inline constexpr Range kNotNegative{0, 1e12};
inline constexpr Range kUnit{0, 1};  // a share or probability

/// The flag of a setting or an alias, such as `--eval-every` for `eval_every`.
std::string FlagOf(std::string name);

/// One setting: what flags, configuration files, help and validation need to know of it.
struct Option {
  /// What a change of the setting changes.
  enum class Decides {
    kTraining,  // the training
    kSeed,      // only the random numbers of the training
    kEnd,       // only the length of the run
    kNothing,   // nothing that the run computes
  };
  using Target = std::variant<bool*, int64_t*, double*, std::string*, std::vector<int64_t>*>;

  std::string section;  // TOML table
  std::string name;     // TOML key; the flag has - for _
  Target target;        // the variable that holds the value
  Range range;          // numbers only
  std::string unit;     // such as "s"; may be empty
  std::string help;     // a noun phrase or an imperative
  Decides decides = Decides::kTraining;
  std::vector<std::string> choices = {};  // texts only: allowed values; empty: any
  double step = 0;                        // numbers only: must be a multiple of it; 0: any number
  // Files of version 0.4.0 may lack the setting; they were made with its default.
  bool implied = false;
  bool read_only = false;  // the setting belongs to a const struct
  std::string usual = {};  // default in words, shown instead of the value; may be empty

  /// Whether another value makes another run, which cannot be resumed.
  bool identity() const { return decides == Decides::kTraining || decides == Decides::kSeed; }
  /// Such as `--eval-every`.
  std::string flag() const;
  /// The value of a setting whose target is a double.
  double number() const { return *std::get<double*>(target); }
  /// The value as TOML writes it.
  std::string text() const;
  /// The value as a command line takes it, such as `64,64`.
  std::string plain_text() const;
  /// Flag and value as a shell's command line has them, such as `--hidden 64,64` or `--no-double`.
  std::string on_command_line() const;
  /// Line of help: text, unit, choices or range, such as `length of a training episode [s] (0.02 to
  /// 10)`.
  std::string about() const;
  /// Line of help with the current value as the default: `… [s] (0.02 to 10; default 4)`.
  std::string about_with_default() const;
  /// Such as `a number in [0, 1]` or `a multiple of 0.02 in [0, 1]`.
  std::string expected() const;
  /// Parses and checks `text`. Throws BadInput that begins with `where` (such as `--gamma` or
  /// `FILE:3: gamma`).
  void Set(std::string_view text, const std::string& where) const;
};

/// The settings of one or more components, in the order in which they were added. Every component
/// has a `void Describe(Options&)`; each of its lines names target, key, range, unit and help of
/// one setting and changes nothing. A setting's default is the initialiser of its member.
class Options {
 public:
  /// Names the section that the following settings belong to.
  void Section(std::string_view section) { section_ = section; }

  /// A switch or a text.
  template <typename T>
  requires std::same_as<T, bool> || std::same_as<T, std::string> Option& Add(
      T* target, std::string_view name, std::string_view help) {
    return AddOption(target, name, {}, "", help);
  }
  /// A number.
  template <typename T>
  requires std::same_as<T, int64_t> || std::same_as<T, double> Option& Add(
      T* target, std::string_view name, Range range, std::string_view unit, std::string_view help) {
    return AddOption(target, name, range, unit, help);
  }
  /// A text that is one of `choices`.
  Option& AddChoice(std::string* target, std::string_view name, std::vector<std::string> choices,
                    std::string_view help);
  /// A list of integers.
  Option& Add(std::vector<int64_t>* target, std::string_view name, Range range,
              std::string_view help) {
    return AddOption(target, name, range, "", help);
  }

  /// One name that sets several settings, such as `mass` for `mass1` and `mass2`. Without `help`
  /// the text is "set … and …".
  void Alias(std::string_view name, std::vector<std::string> members, std::string_view help = "");

  /// Makes a later Set of any of these settings throw std::logic_error.
  void MakeReadOnly() {
    for (Option& option : options_) option.read_only = true;
  }

  /// Adds those of `others` whose names are not among these.
  void AddMissing(const Options& others);

  /// Sets the message of Find for a name that these settings lack.
  void Explain(std::string_view name, std::string_view why);
  /// The text given to Explain; empty if none.
  std::string WhyMissing(std::string_view name) const;

  const std::vector<Option>& all() const { return options_; }
  /// The setting of this name; nullptr if there is none.
  const Option* Get(std::string_view name) const;
  struct AliasEntry {
    std::string section, name;
    std::vector<std::string> members;
    std::string help;

    std::string flag() const;
  };
  const std::vector<AliasEntry>& aliases() const { return aliases_; }

  /// The settings that a name or an alias stands for. Throws BadInput with the nearest name.
  std::vector<const Option*> Find(std::string_view name, const std::string& where) const;

  /// Sets what the name or alias stands for; see Option::Set.
  void Set(std::string_view name, std::string_view text, const std::string& where) const;

  /// The `wanted` settings as a TOML document; with `comments`, each with its description.
  std::string Toml(bool comments, const std::function<bool(const Option&)>& wanted) const;

 private:
  Option& AddOption(Option::Target target, std::string_view name, Range range,
                    std::string_view unit, std::string_view help);

  std::string section_;
  std::vector<Option> options_;
  std::vector<AliasEntry> aliases_;
  std::map<std::string, std::string, std::less<>> missing_;  // name → why there is none
};

/// The settings of a struct. They point into it; those of a const struct can only be read.
template <typename Config>
Options OptionsOf(Config& config) {
  Options options;
  const_cast<std::remove_const_t<Config>&>(config).Describe(options);
  if (std::is_const_v<Config>) options.MakeReadOnly();
  return options;
}

/// A setting whose value differs between two structs.
struct Difference {
  Option now;
  std::optional<Option> before;  // nothing where the other struct has no such setting
};

/// The settings of `now` that `before` lacks or has with another value, in the order of `now`.
std::vector<Difference> Differences(const Options& now, const Options& before);

}  // namespace upswing
