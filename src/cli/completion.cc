// The command `completion`: completions for shells. The scripts ask --help when they complete, so
// that they follow the commands and options. UPSWING_SETUP=no keeps ./upswing from building then.
#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "cli/commands.h"

namespace upswing {
namespace {

// Prints the candidates after the word `last`, from --help: its values if it is a flag with
// choices, else commands and flags. The launcher heads its commands with "Commands:", the program
// with "Subcommands:".
constexpr const char* kAwk = R"(
    /^Named agents:$/ { named = 1 }
    /ommands:$/ { list = 1 }
    /^$/ { list = named = 0 }
    list && /^  [a-z]/ { names = names $1 "\n" }
    named && /^  [a-z]/ { agents = agents $1 "\n" }
    /^  -/ {
      mine = index("," $1 ",", "," last ",") > 0
      if (mine && $2 ~ /^[A-Z]+$/) wants = 1
      gsub(",", "\n", $1)
      names = names $1 "\n"
    }
    mine { about = about " " $0 }
    END {
      gsub(" +", " ", about)
      if (!wants) printf "%s", names
      else if (last == "--agent") printf "%s", agents
      else if (match(about, /\([a-z0-9-]+(, [a-z0-9-]+)+[;)]/)) {
        values = substr(about, RSTART + 1, RLENGTH - 2)
        gsub(", ", "\n", values)
        print values
      }
    })";
constexpr const char* kBash = R"sh(_upswing() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} k help=-h called
  called=("$1")
  for ((k = 1; k < COMP_CWORD && k < 3; ++k)); do
    case ${{COMP_WORDS[k]}} in [a-z]*) called+=("${{COMP_WORDS[k]}}") help=--help ;; esac
  done
  COMPREPLY=($(compgen -W "$(UPSWING_SETUP=no "${{called[@]}}" $help 2>/dev/null |
    awk -v last="${{COMP_WORDS[COMP_CWORD - 1]}}" '{}')" -- "$word"))
}}
complete -o default -F _upswing upswing ./upswing
)sh";
constexpr const char* kZsh = "autoload -U +X bashcompinit && bashcompinit\n";
constexpr const char* kFish = R"(function __upswing_names
  set -l words (commandline -opc)
  set -l called $words[1] (string match -r '^[a-z].*' -- $words[2..3]) -h
  if set -q called[3]
    set called[-1] --help
  end
  UPSWING_SETUP=no $called 2>/dev/null | awk -v last=$words[-1] '{}'
end
complete -c upswing -a '(__upswing_names)'
)";

int RunCompletion(const std::string& shell) {
  if (shell != "bash" && shell != "zsh" && shell != "fish") {
    throw BadInput(Concat("completion: expected bash, zsh or fish, got ", Printable(shell)));
  }
  if (shell == "zsh") fmt::print(kZsh);
  if (shell == "fish") {
    fmt::print(kFish, kAwk);
  } else {
    fmt::print(kBash, kAwk);
  }
  return 0;
}

}  // namespace

void AddCompletion(CommandLine& line) {
  std::string& shell = line.Runs<const std::string&>(RunCompletion);
  line.Text("shell", shell, "SHELL", "bash, zsh or fish", "a shell");
  line.Require("shell");
  line.Examples(
      "  source <(./upswing completion bash)                 in this shell, or in ~/.bashrc\n"
      "  ./upswing completion fish > ~/.config/fish/completions/upswing.fish\n");
}

}  // namespace upswing
