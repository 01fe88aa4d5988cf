// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace organbake {

// One flag of a command line, as help, manual pages and the completions of shells tell it.
struct ManualOption {
  std::string flag;                           // "--faces"
  std::string short_flag = {};                // "-o"; empty: none
  std::string value = {};                     // "N", "PATH" …; empty: a switch
  std::string help = {};                      // what it is
  std::string facts = {};                     // "mm; 0…50; default 2"; empty: none
  std::vector<std::string> choices = {};      // all that the value can be; empty: anything
  std::vector<std::string> suggestions = {};  // what it can be besides a file, for completions
  std::string off_flag = {};                  // "--no-cap": a switch that is on by default
};

struct ManualSection {
  std::string title;
  std::string text = {};                                          // before the entries
  std::vector<std::pair<std::string, std::string>> entries = {};  // term, what it means
};

// What a program, or one of its commands, takes and does. The programs fill it from the very lists
// that they read their arguments by, so that no option is described twice.
struct CommandManual {
  std::string program = {};      // "organbake"
  std::string command = {};      // "decimate"; empty: the program itself
  std::string summary = {};      // half a sentence, lower case
  std::string synopsis = {};     // what stands behind the program's name
  std::string description = {};  // whole sentences
  std::vector<ManualOption> options = {};
  std::vector<ManualOption> shared_options = {};  // of every command of the program
  std::vector<std::string> words = {};       // what a word can be besides a file, for completions
  std::vector<ManualSection> sections = {};  // behind the options
  std::vector<std::string> see_also = {};    // pages: "organplay"

  std::string page() const { return command.empty() ? program : program + "-" + command; }
};

// What every program of the project may end with, as a section.
ManualSection exit_status_section();

// A page for man(1), in the macros of man(7). The version stands in its footer, the day of the
// release in its header.
std::string man_page(const CommandManual& manual, const std::string& version,
                     const std::string& release_date);

// A script for a shell's completion, bash's or zsh's: the program's own options and, where it has
// any, its commands with theirs.
std::string completion(const std::string& shell, const CommandManual& program,
                       const std::vector<CommandManual>& commands);

}  // namespace organbake
