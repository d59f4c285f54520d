#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>

#include "apps/commands.h"
#include "core/error.h"
#include "core/text.h"

namespace upswing {

CLI::Validator NotEmpty() {
  return {[](const std::string& path) -> std::string {
            return path.empty() ? "expected a path, got an empty text" : "";
          },
          ""};
}

CLI::Option* AddPolicy(CLI::App& app, std::string& policy) {
  return app.add_option("policy", policy, "policy.safetensors or run folder")
      ->type_name("POLICY|RUN")
      ->check(NotEmpty());
}

void AddStart(CLI::App& app, std::string& start) {
  app.add_option("--start", start, "where it begins, rad and rad/s [0,0,0,0: hanging]")
      ->type_name("q1,q2,w1,w2");
}

void AddSeed(CLI::App& app, int64_t& seed, const std::string& what) {
  app.add_option("--seed", seed, Concat("of ", what, " [0]"))
      ->check(CLI::Range(int64_t{0}, int64_t{9000000000000000}).description(""))
      ->type_name("INTEGER");
}

void AddThreads(CLI::App& app, int& threads) {
  app.add_option("--threads", threads, "0: one for each processor, at most 8")
      ->check(CLI::Range(0, 256).description(""))
      ->type_name("INTEGER");
}

void AddManyOptions(CLI::App& app, std::string& seeds, int& jobs) {
  app.add_option("--seeds", seeds, "a run for each: 10 for 1 to 10, or a list such as 3,5,8-12")
      ->type_name("SEEDS")
      ->check(NotEmpty());
  app.add_option("--jobs", jobs, "runs at a time [one for each processor]")
      ->type_name("INTEGER")
      ->check(CLI::Range(1, 4096).description(""));
}

void AddPlantOptions(CLI::App& app, std::vector<std::string>& set, std::string& model) {
  app.add_option("--set", set, "another plant, such as mass2=1.2 (repeat for more)")
      ->type_name("NAME=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  app.add_option("--model", model, "MJCF file to use instead of the policy's model")
      ->type_name("FILE")
      ->check(NotEmpty());
}

namespace {

/// What --help shows for a flag's value.
std::string TypeName(const Option& option) {
  constexpr std::array kNames{"", "INTEGER", "NUMBER", "TEXT", "LIST"};  // in Target's order
  return option.name == "model" ? "FILE" : kNames.at(option.target.index());
}

}  // namespace

void AddSettings(CLI::App& app, const Options& options, std::vector<FlagValue>& flags) {
  // CLI11 applies flags in this order: aliases first, so that what is more specific wins.
  for (const auto& alias : options.aliases()) {
    const std::string name = alias.name;
    app.add_option_function<std::string>(
           alias.flag(),
           [&flags, name](const std::string& text) {
             flags.push_back({name, text});
           },
           alias.help)
        ->group(alias.section)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
        ->type_name("NUMBER");
  }
  for (const Option& option : options.all()) {
    std::string help = option.help;
    if (!option.unit.empty()) help += ", " + option.unit;
    if (!option.choices.empty()) help += ": " + Join(option.choices, ", ");
    help += " [" + option.text() + "]";
    const std::string name = option.name;
    if (std::holds_alternative<bool*>(option.target)) {
      app.add_flag_function(
             option.flag() + ",!--no-" + option.flag().substr(2),
             [&flags, name](int64_t on) {
               flags.push_back({name, on > 0 ? "true" : "false"});
             },
             help)
          ->group(option.section)
          ->disable_flag_override();
      continue;
    }
    app.add_option_function<std::string>(
           option.flag(),
           [&flags, name](const std::string& text) {
             flags.push_back({name, text});
           },
           help)
        ->group(option.section)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
        ->type_name(TypeName(option));
  }
}

namespace {

/// Every flag of a subcommand, and the subcommands' names.
std::vector<std::string> KnownWords(const CLI::App& app) {
  std::vector<std::string> words;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
  }
  for (const CLI::App* sub : app.get_subcommands({})) words.push_back(sub->get_name());
  return words;
}

/// One line on what was wrong with the command line.
std::string Explain(const CLI::App& program, const CLI::ParseError& error) {
  const auto chosen = program.get_subcommands();
  const CLI::App& app = chosen.empty() ? program : *chosen.front();
  const std::vector<std::string> unknown = app.remaining();
  const std::string message = error.what();
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr &&
      message.find("flag override") != std::string::npos) {
    return Concat("--", message.substr(0, message.find(' ')), ": takes no value");
  }
  if (unknown.empty()) return message;
  const std::string word = unknown.front().substr(0, unknown.front().find('='));
  return Concat(word.starts_with("-") ? "unknown flag " : "did not expect ", word,
                DidYouMean(word, KnownWords(app)));
}

/// CLI11's help without the `{false}` that it puts behind a flag's --no- form.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
    std::string name = CLI::Formatter::make_option_name(option, is_positional);
    constexpr std::string_view kNoise = "{false}";
    const size_t at = name.find(kNoise);
    return at == std::string::npos ? name : name.erase(at, kNoise.size());
  }
};

/// An error's message, which may quote a stranger's file, as one line of a terminal; the middle of
/// a very long one is left out.
std::string OneLine(std::string_view message) {
  constexpr size_t kBegin = 1500;  // bytes
  constexpr size_t kEnd = 500;
  if (message.size() <= kBegin + kEnd) return Printable(message);
  return Concat(Printable(message.substr(0, kBegin)), " … ",
                Printable(message.substr(message.size() - kEnd)));
}

/// The exit code, unless the output cannot be written.
int Finish(int exit_code) {
  std::cout.flush();
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good()) return exit_code;
  fmt::print(stderr, "upswing: cannot write the output: {}\n", std::strerror(errno));
  return 1;
}

int Main(int argc, char** argv) {
  CLI::App program(
      "Upswing trains, judges and keeps controllers that swing up and balance a double\n"
      "pendulum with one motor at its first joint, in MuJoCo.",
      "upswing");
  program.set_version_flag("--version", "upswing " UPSWING_VERSION);
  program.require_subcommand(1);
  program.formatter(std::make_shared<HelpFormatter>());
  program.footer(
      "Examples:\n"
      "  ./upswing train                      train the default agent until the task is solved\n"
      "  ./upswing eval runs/d3qn-seed1       judge its best policy\n"
      "  ./upswing compare runs               compare the agents in runs over their seeds\n"
      "  ./upswing train --help               every setting, with its default\n");
  Command command;
  AddTrain(program, command);
  AddEval(program, command);
  AddSimulate(program, command);
  AddMap(program, command);
  AddPlot(program, command);
  AddInfo(program, command);
  AddCompare(program, command);
  AddStudy(program, command);
  AddExport(program, command);
  AddBench(program, command);

  try {
    program.parse(argc, argv);
    return Finish(command());
  } catch (const CLI::Success& request) {
    return Finish(program.exit(request));  // --help and --version
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "upswing: {}\n", OneLine(Explain(program, error)));
    return 2;
  } catch (const Error& error) {
    fmt::print(stderr, "upswing: {}\n", OneLine(error.what()));
    return error.exit_code();
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "upswing: out of memory\n");
    return 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "upswing: {}\n", OneLine(error.what()));
    return 1;
  }
}

}  // namespace
}  // namespace upswing

// NOLINTNEXTLINE(bugprone-exception-escape): only what fails while a failure is being told
int main(int argc, char** argv) {
  // A write that cannot be done shall fail where it is made, with a message.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  return upswing::Main(argc, argv);
}
