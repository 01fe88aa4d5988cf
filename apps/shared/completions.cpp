// SPDX-License-Identifier: Apache-2.0
#include "command_manual.h"

namespace organbake {
namespace {

std::vector<ManualOption> all_options(const CommandManual& manual) {
  std::vector<ManualOption> options = manual.options;
  options.insert(options.end(), manual.shared_options.begin(), manual.shared_options.end());
  return options;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at)) {
    text.replace(at, what.size(), by);
    at += by.size();
  }
  return text;
}

std::string names_of(const std::vector<CommandManual>& commands) {
  std::vector<std::string> names;
  for (const CommandManual& command : commands) names.push_back(command.command);
  return joined(names);
}

// ---- bash

std::string bash_flags(const CommandManual& manual) {
  std::vector<std::string> flags;
  for (const ManualOption& option : all_options(manual)) {
    for (const std::string& flag : {option.short_flag, option.flag, option.off_flag}) {
      if (!flag.empty()) flags.push_back(flag);
    }
  }
  return "    '" + manual.command + "') flags='" + joined(flags) + "' ;;\n";
}

std::string bash_choices(const CommandManual& manual) {
  std::string cases;
  for (const ManualOption& option : all_options(manual)) {
    const bool may_be_others = option.choices.empty();
    const auto& words = may_be_others ? option.suggestions : option.choices;
    if (words.empty()) continue;
    cases += "    '" + manual.command + " " + option.flag + "') " +
             (may_be_others ? "words" : "choices") + "='" + joined(words) + "' ;;\n";
  }
  return cases;
}

std::string bash_words(const CommandManual& manual) {
  if (manual.words.empty()) return "";
  return "    '" + manual.command + "') words=${words:-'" + joined(manual.words) + "'} ;;\n";
}

// ---- zsh

// Within single quotes, in the description or the message of _arguments.
std::string zsh_text(std::string text) {
  text = replaced(text, "\\", "\\\\");
  for (const char* special : {"[", "]", ":"})
    text = replaced(text, special, "\\" + std::string(special));
  return replaced(text, "'", "'\\''");
}

std::string zsh_word_or_file(const std::vector<std::string>& words) {
  if (words.empty()) return "_files";
  return " _alternative \"words\\:word\\:(" + joined(words) + ")\" \"files\\:file\\:_files\"";
}

std::string zsh_value(const ManualOption& option) {
  if (option.value.empty()) return "";
  const std::string message = ":" + zsh_text(option.value) + ":";
  return message + (option.choices.empty() ? zsh_word_or_file(option.suggestions)
                                           : "(" + joined(option.choices) + ")");
}

std::string zsh_option(const ManualOption& option) {
  const std::string rest = "[" + zsh_text(option.help) + "]" + zsh_value(option) + "'";
  std::string lines;
  for (const std::string& flag : {option.short_flag, option.flag, option.off_flag}) {
    if (!flag.empty()) lines += " \\\n      '*" + flag + rest;
  }
  return lines;
}

// A word of a command: one that it knows, or a file.
std::string zsh_words(const CommandManual& manual) {
  return (manual.words.empty() ? "'*:file:" : "'*:word:") + zsh_word_or_file(manual.words) + "'";
}

std::string zsh_options(const CommandManual& manual) {
  std::string lines;
  for (const ManualOption& option : all_options(manual)) lines += zsh_option(option);
  return lines;
}

}  // namespace

std::string bash_completion(const CommandManual& program,
                            const std::vector<CommandManual>& commands) {
  std::string flags = bash_flags(program), choices = bash_choices(program),
              words = bash_words(program);
  for (const CommandManual& command : commands) {
    flags += bash_flags(command);
    choices += bash_choices(command);
    words += bash_words(command);
  }
  const std::string name = program.program;
  return "# bash completion for " + name + R"(; made from its own tables of options
_)" + name +
         R"(() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}
  local commands=')" +
         names_of(commands) + R"(' command='' flags='' choices='' words='' word
  COMPREPLY=()
  # Bash takes the '=' of --flag=value for a word.
  if [[ $current == = ]]; then
    current=''
  elif [[ $previous == = ]]; then
    previous=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
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
    mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$current")
  elif [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$flags" -- "$current")
  elif [[ -z $command && -n $commands ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$commands" -- "$current")
  elif [[ -n $words ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"; compgen -f -- "$current")
  fi
}
complete -o bashdefault -o default -F _)" +
         name + " " + name + "\n";
}

std::string zsh_completion(const CommandManual& program,
                           const std::vector<CommandManual>& commands) {
  const std::string name = program.program;
  std::string script =
      "#compdef " + name + "\n# made from its own tables of options\n_" + name + "() {\n";
  if (commands.empty()) {
    return script + "  _arguments" + zsh_options(program) + " \\\n      " + zsh_words(program) +
           "\n}\n_" + name + " \"$@\"\n";
  }
  script +=
      "  local context state state_descr line\n  typeset -A opt_args\n  local -a commands=(\n";
  for (const CommandManual& command : commands) {
    script += "    '" + command.command + ":" + zsh_text(command.summary) + "'\n";
  }
  script += "  )\n  _arguments -C" + zsh_options(program) +
            " \\\n      '1:command:->command' '*::argument:->argument'\n"
            "  if [[ $state == command ]]; then\n    _describe command commands\n    return\n  fi\n"
            "  [[ $state == argument ]] || return\n  case $words[1] in\n";
  for (const CommandManual& command : commands) {
    script += "    " + command.command + ") _arguments" + zsh_options(command) + " \\\n      " +
              zsh_words(command) + " ;;\n";
  }
  return script + "  esac\n}\n_" + name + " \"$@\"\n";
}

}  // namespace organbake
