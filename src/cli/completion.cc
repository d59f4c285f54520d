// The command `completion`: completions for shells. The scripts ask --help when they complete, so
// that they follow the options.
#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "cli/commands.h"

namespace upswing {
namespace {

// The commands and the flags are the first words of the indented lines in --help. The launcher
// heads its commands with "Commands:", the program with "Subcommands:".
constexpr const char* kBash = R"(_upswing() {
  local word=${COMP_WORDS[COMP_CWORD]} names
  if [ "$COMP_CWORD" = 1 ]; then
    names=$("$1" -h 2>/dev/null | sed -n '/ommands:$/,/^$/s/^  \([a-z]*\) .*/\1/p')
  else
    names=$("$1" "${COMP_WORDS[1]}" --help 2>/dev/null | sed -n 's/^  \(-[^ ]*\) .*/\1/p' | tr , '\n')
  fi
  COMPREPLY=($(compgen -W "$names" -- "$word"))
}
complete -o default -F _upswing upswing ./upswing
)";
constexpr const char* kZsh = "autoload -U +X bashcompinit && bashcompinit\n";
constexpr const char* kFish = R"(function __upswing_names
  set -l words (commandline -opc)
  if test (count $words) = 1
    $words[1] -h 2>/dev/null | sed -n '/ommands:$/,/^$/s/^  \([a-z]*\) .*/\1/p'
  else
    $words[1] $words[2] --help 2>/dev/null | sed -n 's/^  \(-[^ ]*\) .*/\1/p' | tr , '\n'
  end
end
complete -c upswing -a '(__upswing_names)'
)";

int RunCompletion(const std::string& shell) {
  if (shell != "bash" && shell != "zsh" && shell != "fish") {
    throw BadInput(Concat("completion: expected bash, zsh or fish, got ", Printable(shell)));
  }
  fmt::print("{}{}", shell == "zsh" ? kZsh : "", shell == "fish" ? kFish : kBash);
  return 0;
}

}  // namespace

void AddCompletion(CommandLine& line) {
  std::string& shell = line.Runs<const std::string&>(RunCompletion);
  line.Text("shell", shell, "SHELL", "bash, zsh or fish", "a shell");
  line.Require("shell");
  line.Footer(
      "Examples:\n"
      "  source <(./upswing completion bash)                 in this shell, or in ~/.bashrc\n"
      "  ./upswing completion fish > ~/.config/fish/completions/upswing.fish\n");
}

}  // namespace upswing
