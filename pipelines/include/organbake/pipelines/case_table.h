// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/pipelines/batch_cases.h"

namespace organbake {

// A table with a header, one case a line (text_table.h): column `case` names it, every other
// column is a key of the recipe ("ct", "label", "decimate.faces"); an empty field sets nothing.
// Paths of inputs are relative to the table's folder. Throws NoInputError, or BadDataError that
// names the line: no column `case`, a name that is no folder's name or comes twice, a row of
// another length.
std::vector<BatchCase> read_case_table(const std::filesystem::path& table);

// The same table with its inputs' paths made absolute, for programs that start elsewhere. Throws
// UsageError for a line break in a value: a table has one case a line.
std::string case_table_text(const std::vector<BatchCase>& cases);

}  // namespace organbake
