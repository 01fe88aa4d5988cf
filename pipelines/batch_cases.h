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

// A table with a header, one case a line (CSV, RFC 4180): column `case` names it, every other
// column is a key of the recipe ("ct", "label", "decimate.faces"); an empty field sets nothing.
// Paths of inputs are relative to the table's folder. Throws NoInputError, or BadDataError that
// names the line: no column `case`, a name that is no folder's name or comes twice, a row of
// another length.
std::vector<BatchCase> read_case_table(const std::filesystem::path& table);

// A case for each file or folder, set as the recipe's input `input` and named after it, without its
// ending. Throws UsageError when two would have the same name.
std::vector<BatchCase> cases_of_files(const std::vector<std::string>& files,
                                      const std::string& input);

// The cases of shard `index` of `count` (from 1): every count-th one. Throws UsageError.
struct Shard {
  std::size_t index = 1, count = 1;
};
Shard parse_shard(const std::string& text);  // "2/8"
std::vector<BatchCase> cases_of_shard(const std::vector<BatchCase>& cases, const Shard& shard);

}  // namespace organbake
