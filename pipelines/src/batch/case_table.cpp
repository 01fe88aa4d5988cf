// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/case_table.h"

#include <algorithm>
#include <map>
#include <set>

#include "documents/text_table.h"
#include "organbake/core/error.h"
#include "organbake/pipelines/recipe.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// A relative path of an input, seen from the table's folder.
std::string resolved(const std::string& key, const std::string& value, const fs::path& folder) {
  if (!is_recipe_input(key) || fs::path(value).is_absolute()) return value;
  return (folder / value).lexically_normal().string();
}

std::size_t name_column_of(const TextTable& table, const std::string& where) {
  const auto found = std::find(table.header.begin(), table.header.end(), "case");
  if (found == table.header.end())
    throw BadDataError(where +
                       ": the header has no column 'case'; write for example: case,ct,mask,label");
  return static_cast<std::size_t>(found - table.header.begin());
}

}  // namespace

std::vector<BatchCase> read_case_table(const fs::path& file) {
  const TextTable table = read_text_table(file);
  const auto where = [&](std::size_t line) { return file.string() + ":" + std::to_string(line); };
  const std::size_t name_column = name_column_of(table, where(table.header_line));
  std::vector<BatchCase> cases;
  std::set<std::string> names;
  for (const TextTable::Row& row : table.rows) {
    BatchCase one{row.fields[name_column], {}};
    const std::string flaw = flaw_of_case_name(one.name);
    if (!flaw.empty())
      throw BadDataError(where(row.line) + ": the case's name '" + one.name + "' " + flaw);
    if (!names.insert(one.name).second) {
      throw BadDataError(where(row.line) + ": case '" + one.name + "' is there twice");
    }
    for (std::size_t k = 0; k < table.header.size(); ++k) {
      const std::string &key = table.header[k], &value = row.fields[k];
      if (k == name_column || value.empty()) continue;
      one.settings.push_back(key + "=" + resolved(key, value, file.parent_path()));
    }
    cases.push_back(std::move(one));
  }
  if (cases.empty()) throw BadDataError(file, "the table holds no case below its header");
  return cases;
}

std::string case_table_text(const std::vector<BatchCase>& cases) {
  std::vector<std::map<std::string, std::string>> rows;
  std::set<std::string> keys;
  for (const BatchCase& one : cases) {
    auto& row = rows.emplace_back();
    for (const std::string& setting : one.settings) {
      const std::string key = setting.substr(0, setting.find('='));
      const std::string value = setting.substr(std::min(setting.size(), key.size() + 1));
      if (setting.find_first_of("\r\n") != std::string::npos) {
        throw UsageError("case '" + one.name + "': " + key +
                         " holds a line break, which no list of commands can carry; rename it");
      }
      row[key] = is_recipe_input(key) ? fs::absolute(value).lexically_normal().string() : value;
      keys.insert(key);
    }
  }
  std::string text = "case";
  for (const std::string& key : keys) text += "," + csv_field(key);
  text += "\n";
  for (std::size_t i = 0; i < cases.size(); ++i) {
    text += csv_field(cases[i].name);
    for (const std::string& key : keys) text += "," + csv_field(rows[i][key]);
    text += "\n";
  }
  return text;
}

}  // namespace organbake
