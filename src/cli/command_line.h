#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "agents/config.h"
#include "base/options.h"

namespace CLI {  // NOLINT(readability-identifier-naming)
class App;
}

/// The program's command line. Only command_line.cc knows the library that parses it.
namespace upswing {

/// Description of an argument whose value must not be empty. An unset shell variable gives an empty
/// one.
inline constexpr std::string_view kPath = "a path";

/// One command: declares its arguments or its own commands, then runs with their values.
class CommandLine {
 public:
  explicit CommandLine(CLI::App& app);

  /// Adds a command of this command, such as `check` of `machine`. One of them is required.
  CommandLine& Subcommand(const std::string& name, const std::string& help);

  /// Adds a text: a flag if the name begins with `--`, else a positional argument. --help shows
  /// `type` for the value. `what` names the expected value in the error for an empty one; an empty
  /// `what` allows empty values.
  void Text(std::string_view name, std::string& target, std::string_view type,
            std::string_view help, std::string_view what = kPath);
  /// Adds a positional argument that takes any number of texts.
  void Texts(std::string_view name, std::vector<std::string>& target, std::string_view type,
             std::string_view help);
  /// Adds a flag that can be repeated, each time with one text.
  void Repeated(std::string_view name, std::vector<std::string>& target, std::string_view type,
                std::string_view help, std::string_view group = "");
  /// Makes an argument that was added required.
  void Require(std::string_view name);
  /// Adds a flag without a value.
  void Flag(std::string_view name, bool& target, std::string_view help);

  /// Adds a flag for each of the command's own numbers and choices. Parsing the flag sets the value
  /// immediately; see Option::Set.
  void Arguments(const Options& options);
  /// Adds a flag for each setting and alias, in the order of their descriptions. Given values are
  /// appended to `flags`.
  void Settings(const Options& options, std::vector<FlagValue>& flags);
  /// Sets the function that chooses the settings in --help. It calls its argument with all added
  /// settings and with the settings to show, whose values are the defaults. A misspelt flag gets
  /// suggestions from the shown settings; a hidden setting's flag gets its WhyMissing as the
  /// message.
  using ShowOptions = std::function<void(const Options& every, const Options& options)>;
  void ShowSettings(std::function<void(const ShowOptions&)> shown);

  /// Sets the examples below the usage in --help: indented lines that begin with ./upswing.
  void Examples(const std::string& text);
  /// Sets the text below the arguments in --help, which -h leaves out.
  void Notes(const std::string& text);
  /// Adds a check that runs once all arguments are known, before anything else.
  void Check(std::function<void()> check);
  /// Adds a check that none of `others` is given together with `name`. `why` ends the message.
  void Excludes(std::string_view name, std::vector<std::string> others, std::string_view why = "");
  /// Sets the function that runs the command and returns the exit code. Returns the arguments that
  /// the function will get; the caller declares them.
  template <typename Arguments>
  std::remove_cvref_t<Arguments>& Runs(int (*run)(Arguments)) {
    const auto arguments = std::make_shared<std::remove_cvref_t<Arguments>>();
    run_ = [arguments, run] { return run(*arguments); };
    return *arguments;
  }

  /// Whether the argument was given.
  bool Has(std::string_view name) const;
  /// The last value given for a flag; empty: none.
  std::string Last(std::string_view name) const;

 private:
  friend int RunProgram(int argc, const char* const* argv,
                        std::span<const struct CommandEntry> table,
                        std::span<const struct Command> own, const std::string& examples);

  /// Runs the checks and the command, or those of the given subcommand. Returns the exit code.
  int Run() const;

  CLI::App& app_;
  std::vector<std::unique_ptr<CommandLine>> subcommands_;
  std::vector<std::function<void()>> checks_;
  std::function<int()> run_;
};

/// A row of the table of all commands.
struct CommandEntry {
  std::string_view name, help;    // help: one line
  std::string_view program = {};  // that has the command; empty: only the launcher has it
};

/// All commands, in the order of --help: the rows of commands.tsv, which the launcher reads, too.
std::span<const CommandEntry> CommandTable();

/// A command that this program has.
struct Command {
  std::string_view name;
  void (*declare)(CommandLine&);
};

/// The first word of the command line that is no flag; empty if there is none.
std::string_view CalledCommand(int argc, const char* const* argv);

/// Parses the command line, runs one of the program's `own` commands and returns its exit code.
/// --help lists `table` and has `examples`. Throws BadInput with a message of one line if the
/// command line is wrong.
int RunProgram(int argc, const char* const* argv, std::span<const CommandEntry> table,
               std::span<const Command> own, const std::string& examples);

/// Largest number of columns in a line of --help: the terminal's, limited to 80 to 100; without a
/// terminal 100.
size_t HelpColumns();

}  // namespace upswing
