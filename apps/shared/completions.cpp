// SPDX-License-Identifier: Apache-2.0
// A shell's completion of commands, flags and their values: one script, in what bash and zsh have
// in common. To zsh it comes behind a line that brings bash's builtins (bashcompinit, part of zsh).
#include "command_manual.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

std::vector<ManualOption> all_options(const CommandManual& manual) {
  std::vector<ManualOption> options = manual.options;
  options.insert(options.end(), manual.shared_options.begin(), manual.shared_options.end());
  return options;
}

std::string flags_of(const CommandManual& manual) {
  std::vector<std::string> flags;
  for (const ManualOption& option : all_options(manual)) {
    for (const std::string& flag : {option.short_flag, option.flag, option.off_flag}) {
      if (!flag.empty()) flags.push_back(flag);
    }
  }
  return "    '" + manual.command + "') flags='" + joined(flags, " ") + "' ;;\n";
}

std::string choices_of(const CommandManual& manual) {
  std::string cases;
  for (const ManualOption& option : all_options(manual)) {
    const bool may_be_others = option.choices.empty();
    const auto& words = may_be_others ? option.suggestions : option.choices;
    if (words.empty()) continue;
    cases += "    '" + manual.command + " " + option.flag + "') " +
             (may_be_others ? "words" : "choices") + "='" + joined(words, " ") + "' ;;\n";
  }
  return cases;
}

std::string words_of(const CommandManual& manual) {
  if (manual.words.empty()) return "";
  return "    '" + manual.command + "') words=${words:-'" + joined(manual.words, " ") + "'} ;;\n";
}

}  // namespace

std::string completion(const std::string& shell, const CommandManual& program,
                       const std::vector<CommandManual>& commands) {
  std::string flags = flags_of(program), choices = choices_of(program), words = words_of(program);
  for (const CommandManual& command : commands) {
    flags += flags_of(command);
    choices += choices_of(command);
    words += words_of(command);
  }
  const std::string name = program.program, how = " -o bashdefault -o default -F _" + name;
  const bool zsh = shell == "zsh";
  return (zsh ? "#compdef " + name + "\nautoload -U +X bashcompinit && bashcompinit\n" : "") +
         "# completion for " + name + R"(; made from its own tables of options
_)" + name +
         R"(() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}
  local commands=')" +
         joined(commands, " ", [](const CommandManual& command) { return command.command; }) +
         R"(' command='' flags='' choices='' words='' word
  COMPREPLY=()
  # Bash takes the '=' of --flag=value for a word.
  if [[ $current == = ]]; then
    current=''
  elif [[ $previous == = ]]; then
    previous=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  for word in "${COMP_WORDS[@]:1:$((COMP_CWORD - 1))}"; do
    if [[ -n $word && " $commands " == *" $word "* ]]; then
      command=$word
      break
    fi
  done
  case "$command $previous" in
)" + choices +
         R"(  esac
  case "$command" in
)" + flags +
         R"(  esac
  case "$command" in
)" + words +
         R"(  esac
  if [[ -n $choices ]]; then
    COMPREPLY=($(compgen -W "$choices" -- "$current"))
  elif [[ $current == -* ]]; then
    COMPREPLY=($(compgen -W "$flags" -- "$current"))
  elif [[ -z $command && -n $commands ]]; then
    COMPREPLY=($(compgen -W "$commands" -- "$current"))
  elif [[ -n $words ]]; then
    COMPREPLY=($(compgen -W "$words" -- "$current"))
  fi
}
complete)" +
         how + " " + name + "\n" +
         (zsh ? "[[ -z $compstate ]] || _bash_complete" + how + "\n" : "");
}

}  // namespace organbake
