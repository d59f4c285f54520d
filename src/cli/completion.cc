// The command `completion`: completions for shells. The scripts ask --help when they complete, so
// that they follow the commands and options. UPSWING_SETUP=no keeps ./upswing from building then.
#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "cli/commands.h"
#include "runs/find_policy.h"
#include "runs/plant_file.h"

namespace upswing {
namespace {

// Prints the candidates after the word `last`, from --help, a line each. After a flag that takes a
// value these are its values; otherwise commands, arguments and, if the word begins with `dash`,
// flags. A last line /files stands for all files. The launcher heads its commands with
// "Commands:", the program with "Subcommands:".
constexpr const char* kAwk = R"(
    function add(names) {
      count = split(names, each, /[ ,]+/)
      for (k = 1; k <= count; ++k) if (!(each[k] in offered)) print each[k]
      for (k = 1; k <= count; ++k) offered[each[k]] = 1
    }
    function offer(about, type) {
      gsub(/ +/, " ", about)
      if (type ~ /^(INTEGER|NUMBER|LIST)$/) return
      if (last == "--agent") add(agents)
      if (about ~ /shipped polic/) add(policies)
      if (about ~ /shipped plant|plant file|twin/ && about !~ /to write/) add(plants)
      if (about ~ /udp:[A-Z]/) add("udp:")
      if (about ~ /serial:[A-Z]/) add("serial:")
      if (about ~ / pty:/) add("pty")
      for (rest = about; match(rest, /\([a-z0-9-]+(, [a-z0-9-]+)+[;)]/);) {
        add(substr(rest, RSTART + 1, RLENGTH - 2))
        rest = substr(rest, RSTART + RLENGTH)
      }
      if (about ~ /FILE|FOLDER|RUN|LOG|TWIN|LINK|file|folder/) print "/files"
    }
    /^$/ { listed = named = positional = mine = 0 }
    positional { arguments = arguments " " $0 }
    /^Positionals:$/ { positional = 1 }
    /^Named agents:$/ { named = 1 }
    /ommands:$/ { listed = 1 }
    listed && /^  [a-z]/ { commands = commands $1 "\n" }
    named && /^  [a-z]/ { agents = agents " " $1 }
    /^  -/ {
      mine = index("," $1 ",", "," last ",") > 0
      if (mine && /^  [^ ]+ ([A-Z]|q1,)/) type = $2
      shown = $1
      gsub(",", "\n", shown)
      flags = flags shown "\n"
    }
    mine { about = about " " $0 }
    END {
      if (type != "") {
        offer(about, type)
      } else {
        printf "%s", commands
        if (dash == "-" || arguments == "") printf "%s", flags
        if (dash != "-" && arguments != "") offer(arguments, "")
      }
    })";
constexpr const char* kBash = R"sh(_upswing() {{
  local IFS=$'\n' word=${{COMP_WORDS[COMP_CWORD]}} k help=-h called names
  called=("$1")
  for ((k = 1; k < COMP_CWORD && k < 3; ++k)); do
    case ${{COMP_WORDS[k]}} in [a-z]*) called+=("${{COMP_WORDS[k]}}") help=--help ;; esac
  done
  names=$(UPSWING_SETUP=no "${{called[@]}}" $help 2>/dev/null |
    awk -v last="${{COMP_WORDS[COMP_CWORD - 1]}}" -v dash="${{word:0:1}}" -v policies='{}' \
      -v plants='{}' '{}')
  COMPREPLY=($(compgen -W "${{names%/files}}" -- "$word"))
  case $names in
    */files)
      compopt -o filenames 2>/dev/null
      COMPREPLY+=($(compgen -f -- "$word"))
      ;;
  esac
}}
complete -o default -F _upswing upswing ./upswing
)sh";
constexpr const char* kZsh = "autoload -U +X bashcompinit && bashcompinit\n";
// fish itself adds files.
constexpr const char* kFish = R"(function __upswing_names
  set -l words (commandline -opc)
  set -l word (commandline -ct)
  set -l called $words[1] (string match -r '^[a-z].*' -- $words[2..3]) -h
  if set -q called[3]
    set called[-1] --help
  end
  UPSWING_SETUP=no $called 2>/dev/null | awk -v last=$words[-1] -v "dash="(string sub -l 1 -- "$word") \
    -v policies='{}' -v plants='{}' '{}' | string match -v /files
end
complete -c upswing -a '(__upswing_names)'
)";

int RunCompletion(const std::string& shell) {
  if (shell != "bash" && shell != "zsh" && shell != "fish") {
    throw BadInput(Concat("completion: expected bash, zsh or fish, got ", Printable(shell)));
  }
  const std::string policies = Join(ShippedPolicies(), " ");
  const std::string plants = Join(NamesOf(EmbeddedPlants()), " ");
  if (shell == "zsh") fmt::print(kZsh);
  if (shell == "fish") {
    fmt::print(kFish, policies, plants, kAwk);
  } else {
    fmt::print(kBash, policies, plants, kAwk);
  }
  return 0;
}

}  // namespace

void AddCompletion(CommandLine& line) {
  std::string& shell = line.Runs<const std::string&>(RunCompletion);
  line.Text("shell", shell, "SHELL", "shell to print completions for (bash, zsh, fish)", "a shell");
  line.Require("shell");
  line.Examples(
      "  source <(./upswing completion bash)                 in this shell, or in ~/.bashrc\n"
      "  ./upswing completion fish > ~/.config/fish/completions/upswing.fish\n");
}

}  // namespace upswing
