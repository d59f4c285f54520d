#include "apps/help.h"

#include <algorithm>

#include "core/text.h"

namespace upswing {
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

std::vector<std::string> SubcommandNames(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* sub : program.get_subcommands({})) names.push_back(sub->get_name());
  return names;
}

/// What is missing on the command line.
std::string ExplainMissing(const CLI::App& program, const CLI::App& app) {
  if (&app == &program) {
    return Concat("expected a command, one of ", Join(SubcommandNames(program), ", "),
                  "; got none");
  }
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_required() || option->count() > 0) continue;
    return Concat(app.get_name(), ": expected ", option->get_type_name(), " (",
                  option->get_description(), "), got none");
  }
  return Concat(app.get_name(), ": an argument is missing");
}

/// What was wrong with the values of a flag. CLI11 names the flag only at the beginning of its
/// message, such as `--gamma: 1 required NUMBER missing`.
std::string ExplainValues(const std::string& message) {
  if (message.find("flag override") != std::string::npos) {
    return Concat("--", message.substr(0, message.find(' ')), ": takes no value");
  }
  const std::string flag = message.substr(0, message.find_first_of(": "));
  const bool several = message.find("received") != std::string::npos;
  return Concat(flag, ": expected a value, got ", several ? "several" : "none");
}

}  // namespace

std::string WrapText(std::string_view text, size_t columns, size_t indent) {
  std::string wrapped;
  size_t column = indent;  // where the line ends so far
  for (const std::string_view word : Split(text, ' ')) {
    if (word.empty()) continue;
    // Continuation bytes of UTF-8 take no column.
    const auto width = static_cast<size_t>(std::ranges::count_if(
        word, [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
    const bool is_first = column == indent;
    if (!is_first && column + 1 + width > columns) {
      wrapped += '\n' + std::string(indent, ' ');
      column = indent;
    } else if (!is_first) {
      wrapped += ' ';
      ++column;
    }
    wrapped += word;
    column += width;
  }
  return wrapped;
}

std::string HelpFormatter::make_help(const CLI::App* app, std::string name,
                                     CLI::AppFormatMode mode) const {
  if (before_) before_();
  return CLI::Formatter::make_help(app, std::move(name), mode);
}

std::string HelpFormatter::make_option_name(const CLI::Option* option, bool is_positional) const {
  std::string name = CLI::Formatter::make_option_name(option, is_positional);
  constexpr std::string_view kNoise = "{false}";
  const size_t at = name.find(kNoise);
  return at == std::string::npos ? name : name.erase(at, kNoise.size());
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  std::string description = option->get_description();
  std::ranges::replace(description, '\n', ' ');  // lines end where the width asks for it
  return WrapText(description, kHelpColumns - get_column_width());
}

std::string Explain(const CLI::App& program, const CLI::ParseError& error) {
  const auto chosen = program.get_subcommands();
  const CLI::App& app = chosen.empty() ? program : *chosen.front();
  if (const std::vector<std::string> unknown = app.remaining(); !unknown.empty()) {
    const std::string word = unknown.front().substr(0, unknown.front().find('='));
    return Concat(word.starts_with("-") ? "unknown flag " : "did not expect ", word,
                  DidYouMean(word, KnownWords(app)));
  }
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
    return ExplainMissing(program, app);
  }
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    return ExplainValues(error.what());
  }
  return error.what();
}

}  // namespace upswing
