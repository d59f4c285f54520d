#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace upswing {

/// The columns that a line of --help has at most.
inline constexpr size_t kHelpColumns = 100;

/// CLI11's help within kHelpColumns, and without the `{false}` that it adds to a flag's --no- form.
class HelpFormatter : public CLI::Formatter {
 public:
  /// `before` is called before help is printed, which may depend on the other arguments.
  explicit HelpFormatter(std::function<void()> before = {}) : before_(std::move(before)) {}

  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override;
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override;
  std::string make_option_desc(const CLI::Option* option) const override;

 private:
  std::function<void()> before_;
};

/// `text` in lines of at most `columns` characters, broken at blanks. All lines but the first begin
/// with `indent` blanks; the first one stands behind so many columns that the caller fills. A
/// longer word has a line of its own.
std::string WrapText(std::string_view text, size_t columns, size_t indent = 0);

/// One line on what was wrong with the command line.
std::string Explain(const CLI::App& program, const CLI::ParseError& error);

}  // namespace upswing
