// SPDX-License-Identifier: Apache-2.0
// Manual pages for man(1), and a shell's completion of commands, flags and their values: one
// script, in what bash and zsh have in common. To zsh it comes behind a line that brings bash's
// builtins (bashcompinit, part of zsh).
#include "command_line.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "organbake/core/text.h"

namespace organbake {
namespace {

// Characters that roff reads as commands, or typesets as others.
std::string escaped(const std::string& text) {
  constexpr std::string_view kLetters = "\\-'`^~";
  constexpr std::array<const char*, 6> kSpelt = {"\\e", "\\-", "\\(aq", "\\(ga", "\\(ha", "\\(ti"};
  std::string roff;
  for (const char c : text) {
    const std::size_t at = kLetters.find(c);
    at == kLetters.npos ? roff += c : roff += kSpelt[at];
  }
  return roff;
}

// Columns that a text takes in roff: readers of man pages spell other characters as \[u2026].
std::size_t width_of(const std::string& text) {
  constexpr std::size_t kSpelt = 8;
  std::size_t width = 0;
  for (const unsigned char c : text) {
    const bool continues = (c & 0xC0) == 0x80;
    if (!continues) width += c < 0x80 ? 1 : kSpelt;
  }
  return width;
}

// Running text, its words filled into lines; one that begins with a dot would be a command.
std::string filled(const std::string& text) {
  constexpr std::size_t kWidth = 78;
  std::string roff, line;
  const std::string words = escaped(text) + ' ';
  for (std::size_t begin = 0; begin < words.size();) {
    const std::size_t end = words.find_first_of(" \n", begin);
    std::string word = words.substr(begin, end - begin);
    begin = end + 1;
    if (word.empty()) continue;
    if (!line.empty() && width_of(line) + 1 + width_of(word) > kWidth) {
      roff += line + "\n";
      line.clear();
    }
    if (line.empty() && word.front() == '.') word = "\\&" + word;
    line += (line.empty() ? "" : " ") + word;
  }
  return line.empty() ? roff : roff + line + "\n";
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::toupper(c)); });
  return text;
}

std::string sentence(std::string text) {
  if (text.empty()) return text;
  text.front() = char(std::toupper(static_cast<unsigned char>(text.front())));
  return text.back() == '.' ? text : text + ".";
}

std::string tag(const ManualOption& option) {
  std::string roff;
  if (!option.short_flag.empty()) roff = "\\fB" + escaped(option.short_flag) + "\\fR, ";
  roff += "\\fB" + escaped(option.flag) + "\\fR";
  if (!option.value.empty()) roff += " \\fI" + escaped(option.value) + "\\fR";
  if (!option.off_flag.empty()) roff += ", \\fB" + escaped(option.off_flag) + "\\fR";
  return roff;
}

std::string options_section(const std::string& title, const std::vector<ManualOption>& options) {
  if (options.empty()) return "";
  std::string roff = ".SH " + title + "\n";
  for (const ManualOption& option : options) {
    roff += ".TP\n" + tag(option) + "\n";
    roff += filled(option.facts.empty() ? option.help : option.help + " [" + option.facts + "]");
  }
  return roff;
}

std::string section(const ManualSection& section) {
  std::string roff = ".SH " + escaped(upper(section.title)) + "\n" + filled(section.text);
  for (const auto& [term, meaning] : section.entries) {
    roff += ".TP\n\\fB" + escaped(term) + "\\fR\n" + filled(meaning);
  }
  return roff;
}

}  // namespace

ManualSection exit_status_section() {
  return {.title = "exit status",
          .entries = {
              {"0", "Done."},
              {"2", "Usage: an unknown flag, a missing argument, a value out of range."},
              {"3", "Everything ran, but a quality that was asked for was not reached."},
              {"4", "Part of a batch failed."},
              {"65", "Bad data: a file's content is wrong, a changed byte in a bundle too."},
              {"66", "No input: a file or folder is missing or cannot be opened."},
              {"70", "A defect of the program, or a processor without AVX2."},
              {"73",
               "Cannot write: no permission, a full disk, or a folder that holds files that the "
               "program did not write."},
              {"74", "The system failed while reading."},
              {"75", "Try again: out of memory, or killed from outside."},
              {"78", "A recipe's key or value is wrong."},
              {"130", "Interrupted."}}};
}

std::string man_page(const CommandManual& manual, const std::string& version,
                     const std::string& release_date) {
  std::string roff = ".TH " + upper(manual.page()) + " 1 " + release_date + " \"" + manual.program +
                     " " + version + "\" \"User Commands\"\n";
  roff += ".SH NAME\n" + manual.page() + " \\-\n" + filled(manual.summary);
  roff += ".SH SYNOPSIS\n.B " + manual.program + "\n" + filled(manual.synopsis);
  roff += ".SH DESCRIPTION\n" + filled(sentence(manual.description));
  roff += options_section("OPTIONS", manual.options);
  roff += options_section("SHARED OPTIONS", manual.shared_options);
  for (const ManualSection& one : manual.sections) roff += section(one);
  if (manual.see_also.empty()) return roff;
  roff += ".SH SEE ALSO\n";
  for (const std::string& page : manual.see_also) {
    roff += ".BR " + escaped(page) + " (1)" + (&page == &manual.see_also.back() ? "\n" : ",\n");
  }
  return roff;
}

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
