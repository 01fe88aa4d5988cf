// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "command_manual.h"
#include "organbake/options/options.h"

namespace organbake {

using Arguments = std::vector<std::string>;

// Sets the options that the arguments name ("--faces 80", "--faces=80", "--cap", "--no-cap",
// "-o FILE") and returns the other words in order. After "--" everything is a word. With
// `only_leading`, it stops before the first word and drops what it read from `arguments`. Throws
// UsageError: an unknown flag with the nearest known one, a missing or impossible value.
// `notes` gets what is to be said of flags that are no longer settings.
std::vector<std::string> read_arguments(Arguments& arguments, const OptionList& options,
                                        std::vector<std::string>& notes, bool only_leading = false);

// Each option as manual pages and completions tell it.
std::vector<ManualOption> manual_options(const OptionList& options);

// For each group its title, and one option a line or more: flag, kind of value, help, unit, range,
// default.
std::string options_help(const OptionList& options);

// The flags that every program and each of its commands has.
struct SharedFlags {
  int threads = 0;  // 0 = all
  bool json = false, quiet = false, verbose = false, version = false, help = false;
  std::string color = "auto";
  std::filesystem::path cache;  // a user's default of the flag that organbake's commands have

  OptionList options();
  // Takes the defaults of threads, color and cache from the user's configuration_file(), where
  // there is one. Throws UsageError with file and line of what cannot be read.
  void read_defaults();
};

// What a program that is one command is asked about itself; organbake has commands for it.
struct ManualFlags {
  bool man = false;
  std::string shell;  // bash or zsh; empty: no completions are asked for

  OptionList options();
  // The page or the script that was asked for; nothing where the program is to work.
  std::optional<std::string> text(const CommandManual& manual) const;
};

// $XDG_CONFIG_HOME/organbake/config, else ~/.config/organbake/config; empty without a home.
std::filesystem::path configuration_file();

// "organplay 0.6.0" in a line, or as JSON.
std::string version_text(const std::string& program, bool json);

}  // namespace organbake
