#include "cli/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "cli/output_files.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "os/command.h"
#include "os/terminal.h"

namespace upswing {
namespace {

/// The placeholder of a setting's value in --help.
std::string TypeName(const Option& option) {
  constexpr std::array kNames{"", "INTEGER", "NUMBER", "TEXT", "LIST"};  // in the order of Target
  return kNames.at(option.target.index());
}

CLI::Validator NotEmpty(std::string_view what) {
  return {[what = std::string(what)](const std::string& text) -> std::string {
            return text.empty() ? Concat("expected ", what, ", got an empty text") : "";
          },
          ""};
}

/// A function that receives a flag's value.
using TakeValue = std::function<void(const std::string&)>;

/// Adds the flag of one setting. If the flag is repeated, the last value counts.
void AddFlag(CLI::App& app, const Option& option, const std::string& group, const TakeValue& take) {
  const std::string help = option.about_with_default();
  if (std::holds_alternative<bool*>(option.target)) {
    app.add_flag_function(
           option.flag() + ",!--no-" + option.flag().substr(2),
           [take](int64_t on) { take(on > 0 ? "true" : "false"); }, help)
        ->group(group)
        ->disable_flag_override();
    return;
  }
  CLI::Option* flag = app.add_option_function<std::string>(option.flag(), take, help)
                          ->group(group)
                          ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
                          ->type_name(TypeName(option));
  // Files of settings may have an empty text. On a command line it is an unset shell variable.
  if (std::holds_alternative<std::string*>(option.target) && option.choices.empty()) {
    flag->check(NotEmpty("a value"));
  }
}

/// `text` with its prose wrapped to HelpColumns(). Indented lines and headings (`Examples:`) keep
/// their line breaks.
std::string Reflowed(const std::string& text) {
  std::string result, prose;
  const auto end_paragraph = [&] {
    if (!prose.empty()) result += WrapText(prose, HelpColumns()) + '\n';
    prose.clear();
  };
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.starts_with(' ')) {
      end_paragraph();
      result += Concat(line, '\n');
      continue;
    }
    const bool heading = prose.empty() && line.ends_with(':');
    prose += Concat(prose.empty() ? "" : " ", line);
    if (heading) end_paragraph();
  }
  end_paragraph();
  return result;
}

/// Formats -h and --help of a command within HelpColumns(): description, usage, examples,
/// arguments, commands and notes.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string examples, notes;
  std::function<void()> hide_flags;  // chooses the settings to show, which depend on the arguments
  bool is_short = false;             // -h: neither settings nor notes

  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    if (hide_flags) hide_flags();
    std::string help = make_description(app) + make_usage(app, std::move(name));
    if (!examples.empty()) help += "\nExamples:\n" + Shown(examples);
    help += make_positionals(app);
    for (const std::string& group : app->get_groups()) {
      if (!is_short || group == kOwnFlags) help += Group(*app, group);
    }
    help += make_subcommands(app, mode);
    if (is_short) return help + "\n--help also shows all settings.\n";
    return notes.empty() ? help : help + '\n' + Shown(notes);
  }

  /// The names of an option, without the `{false}` that CLI11 adds to a flag's --no- form.
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
    return Replaced(CLI::Formatter::make_option_name(option, is_positional), "{false}", "");
  }

  std::string make_option_desc(const CLI::Option* option) const override {
    std::string description = option->get_description();
    std::ranges::replace(description, '\n', ' ');  // the wrapping below sets the line ends
    return WrapText(description, HelpColumns() - get_column_width());
  }

 private:
  static constexpr std::string_view kOwnFlags = "Options";  // CLI11's group of flags without one

  /// A text with the command that starts an installed program.
  static std::string Shown(const std::string& text) {
    return Reflowed(Replaced(text, "./upswing ", Concat(LaunchCommand(), " ")));
  }

  /// The flags of a group, with its name above them; empty if there are none to show.
  std::string Group(const CLI::App& app, const std::string& group) const {
    std::vector<const CLI::Option*> flags = app.get_options([&](const CLI::Option* option) {
      return option->get_group() == group && option->nonpositional();
    });
    // The command's own flags by name, --help first. Settings keep the order of their descriptions.
    if (group == kOwnFlags) {
      std::ranges::sort(flags, {}, [&](const CLI::Option* option) {
        return std::pair(option != app.get_help_ptr(), option->get_name());
      });
    }
    return group.empty() || flags.empty() ? "" : make_group(group, false, flags);
  }
};

/// The formatter of a command.
HelpFormatter& FormatterOf(const CLI::App& app) {
  return dynamic_cast<HelpFormatter&>(*app.get_formatter());
}

/// Lets -h print the short help of a command and of its commands.
void ShortenHelp(CLI::App& app) {
  FormatterOf(app).is_short = true;
  for (CLI::App* sub : app.get_subcommands({})) ShortenHelp(*sub);
}

std::vector<std::string> FlagsOf(const CLI::Option& option) {
  std::vector<std::string> flags;
  for (const std::string& name : option.get_lnames()) flags.push_back("--" + name);
  return flags;
}

bool IsHidden(const CLI::Option& option) { return option.get_group().empty(); }

/// All flags of a command that are not hidden, and the names of its subcommands.
std::vector<std::string> KnownWords(const CLI::App& app) {
  std::vector<std::string> words;
  for (const CLI::Option* option : app.get_options()) {
    if (!IsHidden(*option)) std::ranges::copy(FlagsOf(*option), std::back_inserter(words));
  }
  for (const CLI::App* sub : app.get_subcommands({})) words.push_back(sub->get_name());
  return words;
}

/// The name of a command, such as `machine check`.
std::string FullName(const CLI::App& app) {
  const CLI::App* parent = app.get_parent();
  const bool is_nested = parent != nullptr && parent->get_parent() != nullptr;
  return is_nested ? Concat(FullName(*parent), " ", app.get_name()) : app.get_name();
}

/// Suggests a similar flag for an unknown one, explains why this command lacks it, or names a
/// declared command that has it.
std::string ExplainFlag(const CLI::App& app, const std::string& word) {
  if (const auto& hide_flags = FormatterOf(app).hide_flags) hide_flags();
  if (std::string meant = DidYouMean(word, KnownWords(app)); !meant.empty()) return meant;
  for (const CLI::Option* option : app.get_options()) {
    const bool near = IsHidden(*option) && !DidYouMean(word, FlagsOf(*option)).empty();
    if (near) return Concat("; ", option->get_description());
  }
  const CLI::App& parent = app.get_parent() == nullptr ? app : *app.get_parent();
  for (const CLI::App* sibling : parent.get_subcommands({})) {
    if (sibling->get_option_no_throw(word) != nullptr) {
      return Concat("; ", FullName(*sibling), " has it");
    }
  }
  return "";
}

/// Whether `app` is the program or a command with commands of its own.
bool HasCommands(const CLI::App& app) { return !app.get_subcommands({}).empty(); }

/// The message for `got`, which is not a command of `app`.
std::string ExplainCommands(const CLI::App& app, const std::string& got) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands({})) names.push_back(sub->get_name());
  const std::string where = app.get_parent() == nullptr ? "" : Concat(app.get_name(), ": ");
  return Concat(where, "expected a command, one of ", Join(names, ", "), "; got ", got);
}

/// The message for a missing argument.
std::string ExplainMissing(const CLI::App& app) {
  if (HasCommands(app)) return ExplainCommands(app, "none");
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_required() || option->count() > 0) continue;
    const std::string flag = option->nonpositional() ? option->get_name() + " " : "";
    return Concat(FullName(app), ": expected ", flag, option->get_type_name(), " (",
                  option->get_description(), "), got none");
  }
  return Concat(FullName(app), ": expected another argument, got none");
}

/// The message for a wrong number of values: of a switch, which takes none, of a flag that is given
/// twice, or of the last word, a flag without its value.
std::string ExplainValues(const CLI::App& app, std::span<const char* const> words) {
  for (const std::string_view word : words) {
    const std::string name(word.substr(0, word.find('=')));
    if (name.size() == word.size() || !name.starts_with("--")) continue;
    const CLI::Option* option = app.get_option_no_throw(name);
    if (option != nullptr && option->get_items_expected_max() == 0) {
      return Concat(name, ": expected no value, got one");
    }
  }
  for (const CLI::Option* option : app.get_options()) {
    const bool takes_one = option->get_items_expected_max() == 1 &&
                           option->get_multi_option_policy() == CLI::MultiOptionPolicy::Throw;
    if (takes_one && option->count() > 1) {
      return Concat(option->get_name(), ": expected a value, got several");
    }
  }
  return Concat(words.back(), ": expected a value, got none");
}

/// Explains the first word that `app`, the program or a command, does not know; empty if it knows
/// all.
std::string ExplainUnknown(const CLI::App& app) {
  const std::vector<std::string> unknown = app.remaining();
  if (unknown.empty()) return "";
  const std::string word = unknown.front().substr(0, unknown.front().find('='));
  if (word == "--set" && app.get_option_no_throw("--mass2") != nullptr) {
    return "unknown flag --set: expected a flag for each setting, such as --mass2 1.1";
  }
  if (word.starts_with("-")) return Concat("unknown flag ", word, ExplainFlag(app, word));
  std::string meant = DidYouMean(word, KnownWords(app));
  if (HasCommands(app)) return ExplainCommands(app, Concat("\"", Printable(word), "\"", meant));
  if (meant.empty()) {
    const bool has_agents = app.get_option_no_throw("--agent") != nullptr;
    meant = Concat("; a value follows its flag, as in --",
                   has_agents ? Concat("agent ", word) : std::string("seed 1"));
  }
  return Concat(FullName(app), ": expected no argument ", word, meant);
}

/// The message for a wrong command line of these words, in one line.
std::string Explain(const CLI::App& program, const CLI::ParseError& error,
                    std::span<const char* const> words) {
  const CLI::App* app = &program;  // the innermost command
  for (const CLI::App* each = app; each != nullptr;) {
    app = each;
    if (std::string unknown = ExplainUnknown(*app); !unknown.empty()) return unknown;
    const auto chosen = app->get_subcommands();
    each = chosen.empty() ? nullptr : chosen.front();
  }
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) return ExplainMissing(*app);
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    return ExplainValues(*app, words);
  }
  return error.what();
}

/// Adds a text argument; `Target` is std::string or a vector.
template <typename Target>
CLI::Option* AddText(CLI::App& app, std::string_view name, Target& target, std::string_view type,
                     std::string_view help, std::string_view what) {
  CLI::Option* option = app.add_option(std::string(name), target, std::string(help));
  if (!type.empty()) option->type_name(std::string(type));
  if (!what.empty()) option->check(NotEmpty(what));
  return option;
}

/// The texts of the command line that may name files.
std::vector<NamedFile> NamedFiles(const CLI::App& app) {
  constexpr std::array kOutputs{"--out", "--csv",    "--figure",       "--onnx", "--c",
                                "--log", "--record", "--episodes-csv", "--file"};
  std::vector<NamedFile> files;
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->nonpositional() ? option->get_name() : "the argument";
    const bool is_output = std::ranges::find(kOutputs, name) != kOutputs.end();
    for (const std::string& text : option->results()) files.push_back({name, text, is_output});
  }
  return files;
}

/// Whether packages have a command: they leave out some programs, and the launcher.
bool IsInPackages(const CommandEntry& entry) {
  return !entry.program.empty() &&
         std::filesystem::exists(SiblingProgram(std::string(entry.program)));
}

}  // namespace

CommandLine::CommandLine(CLI::App& app) : app_(app) {
  app_.formatter(std::make_shared<HelpFormatter>());
}

CommandLine& CommandLine::Subcommand(const std::string& name, const std::string& help) {
  app_.require_subcommand(1);
  CLI::App& app = *app_.add_subcommand(name, help);
  return *subcommands_.emplace_back(std::make_unique<CommandLine>(app));
}

int CommandLine::Run() const {
  for (const auto& subcommand : subcommands_) {
    if (subcommand->app_.parsed()) return subcommand->Run();
  }
  ExpectOtherOutputs(NamedFiles(app_));
  for (const auto& check : checks_) check();
  return run_();
}

size_t HelpColumns() { return static_cast<size_t>(std::clamp(TerminalWidth(100), 80, 100)); }

void CommandLine::Text(std::string_view name, std::string& target, std::string_view type,
                       std::string_view help, std::string_view what) {
  AddText(app_, name, target, type, help, what);
}

void CommandLine::Texts(std::string_view name, std::vector<std::string>& target,
                        std::string_view type, std::string_view help) {
  AddText(app_, name, target, type, help, kPath);
}

void CommandLine::Repeated(std::string_view name, std::vector<std::string>& target,
                           std::string_view type, std::string_view help, std::string_view group) {
  CLI::Option* option = AddText(app_, name, target, type, help, "");
  option->take_all()->allow_extra_args(false);
  if (!group.empty()) option->group(std::string(group));
}

void CommandLine::Require(std::string_view name) { app_.get_option(std::string(name))->required(); }

void CommandLine::Flag(std::string_view name, bool& target, std::string_view help) {
  app_.add_flag(std::string(name), target, std::string(help))->disable_flag_override();
}

void CommandLine::Arguments(const Options& options) {
  for (const Option& option : options.all()) {
    AddFlag(app_, option, "Options",
            [option](const std::string& text) { option.Set(text, option.flag()); });
  }
}

void CommandLine::Settings(const Options& options, std::vector<FlagValue>& flags) {
  // CLI11 applies flags in this order. Aliases come first, so that the more specific flag wins.
  for (const auto& alias : options.aliases()) {
    Option as_one = *options.Find(alias.name, alias.name).front();
    as_one.help = alias.help;
    app_.add_option_function<std::string>(
            FlagOf(alias.name),
            [&flags, name = alias.name](const std::string& text) {
              flags.push_back({name, text});
            },
            as_one.about())
        ->group(alias.section)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
        ->type_name("NUMBER");
  }
  for (const Option& option : options.all()) {
    AddFlag(app_, option, option.section, [&flags, name = option.name](const std::string& text) {
      flags.push_back({name, text});
    });
  }
}

void CommandLine::ShowSettings(std::function<void(const ShowOptions&)> shown) {
  const auto show = [this](const Options& every, const Options& options) {
    for (const Option& option : every.all()) {
      CLI::Option* flag = app_.get_option(option.flag());
      const Option* found = options.Get(option.name);
      flag->group(found == nullptr ? "" : found->section);
      flag->description(found == nullptr ? options.WhyMissing(option.name)
                                         : found->about_with_default());
    }
  };
  FormatterOf(app_).hide_flags = [shown = std::move(shown), show] { shown(show); };
}

void CommandLine::Examples(const std::string& text) { FormatterOf(app_).examples = text; }

void CommandLine::Notes(const std::string& text) { FormatterOf(app_).notes = text; }

void CommandLine::Check(std::function<void()> check) { checks_.push_back(std::move(check)); }

void CommandLine::Excludes(std::string_view name, std::vector<std::string> others,
                           std::string_view why) {
  Check([this, name = std::string(name), others = std::move(others), why = std::string(why)] {
    for (const std::string& other : others) {
      if (!Has(name) || !Has(other)) continue;
      throw BadInput(Concat(name, ": expected no ", other, " with it", why));
    }
  });
}

bool CommandLine::Has(std::string_view name) const { return app_.count(std::string(name)) > 0; }

std::string CommandLine::Last(std::string_view name) const {
  const std::vector<std::string> values = app_.get_option(std::string(name))->results();
  return values.empty() ? "" : values.back();
}

std::string_view CalledCommand(int argc, const char* const* argv) {
  const auto words = std::span(argv, static_cast<size_t>(argc)).subspan(argc > 0 ? 1 : 0);
  const auto called =
      std::ranges::find_if(words, [](std::string_view word) { return !word.starts_with('-'); });
  return called == words.end() ? std::string_view() : *called;
}

int RunProgram(int argc, const char* const* argv, std::span<const CommandEntry> table,
               std::span<const Command> own, const std::string& examples) {
  CLI::App program(
      "Upswing trains, compares, explains and deploys controllers that swing up and\n"
      "balance a double pendulum with one motor.",
      "upswing");
  program.set_help_flag("-h,--help", "Print a short help (-h), or all of it (--help)");
  program.set_version_flag("--version", "upswing " UPSWING_VERSION);
  program.require_subcommand(1);
  const auto formatter = std::make_shared<HelpFormatter>();
  constexpr size_t kCommandColumns = 14;
  formatter->column_width(kCommandColumns);
  program.formatter(formatter);
  formatter->examples = examples;
  const bool installed = IsInstalled();
  for (const CommandEntry& entry : table) {
    if (installed && !IsInPackages(entry)) continue;
    program.add_subcommand(std::string(entry.name), std::string(entry.help));
  }
  // Only the called command has arguments.
  const std::string_view called = CalledCommand(argc, argv);
  const auto command = std::ranges::find(own, called, &Command::name);
  std::optional<CommandLine> line;
  if (command != own.end()) {
    command->declare(line.emplace(*program.get_subcommand(std::string(called))));
  }
  if (std::ranges::any_of(std::span(argv, static_cast<size_t>(argc)),
                          [](std::string_view word) { return word == "-h"; })) {
    ShortenHelp(program);
  }
  try {
    program.parse(argc, argv);
  } catch (const CLI::Success& request) {  // --help and --version
    if (const std::string unknown = ExplainUnknown(program); !unknown.empty()) {
      throw BadInput(unknown);
    }
    return program.exit(request);
  } catch (const CLI::ParseError& error) {
    throw BadInput(Explain(program, error, std::span(argv, static_cast<size_t>(argc))));
  }
  if (!line) throw BadInput(ExplainCommands(program, Printable(std::string(called))));
  return line->Run();
}

}  // namespace upswing
