// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

// One bake of a batch: a name, which is its folder's, and what it sets in the recipe.
struct BatchCase {
  std::string name;
  std::vector<std::string> settings;  // "key=value", as bake's --set takes them
};

// Empty when the text can name a case's folder, else what is wrong with it.
std::string flaw_of_case_name(const std::string& name);

// The cases of a command's words: one table (text_table.h), or files, folders and patterns of them
// (file_pattern.h), each set as the recipe's input `input`. Such a case is called after its file
// without the ending, or of a pattern after the path below the pattern's fixed folder
// ("2021_july_clip3"), so that its name doesn't depend on what else is there. Throws UsageError
// for two of one name; NoInputError; BadDataError for a bad table.
std::vector<BatchCase> cases_of_words(const std::vector<std::string>& words,
                                      const std::string& input);

// The cases of shard `index` of `count` (from 1): every count-th one. Throws UsageError.
struct Shard {
  std::size_t index = 1, count = 1;
};
Shard parse_shard(const std::string& text);  // "2/8"
std::vector<BatchCase> cases_of_shard(const std::vector<BatchCase>& cases, const Shard& shard);

}  // namespace organbake
