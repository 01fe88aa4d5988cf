// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/case_table.h"

#include <algorithm>
#include <map>
#include <set>

#include "core/error.h"
#include "core/files.h"
#include "pipelines/recipe.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// One record; fields may be quoted, but not span lines: no path of ours does.
std::vector<std::string> fields_of(const std::string& line, const std::string& where) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted) {
      if (c != '"') {
        fields.back() += c;
      } else if (i + 1 < line.size() && line[i + 1] == '"') {
        fields.back() += line[++i];
      } else {
        quoted = false;
      }
    } else if (c == '"' && fields.back().empty()) {
      quoted = true;
    } else if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  if (quoted) throw BadDataError(where + ": a quoted field is not closed on its line");
  return fields;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char c : text) {
    if (c == '\n') {
      lines.emplace_back();
    } else if (c != '\r') {
      lines.back() += c;
    }
  }
  return lines;
}

// A relative path of an input, seen from the table's folder.
std::string resolved(const std::string& key, const std::string& value, const fs::path& folder) {
  if (!is_recipe_input(key) || fs::path(value).is_absolute()) return value;
  return (folder / value).lexically_normal().string();
}

}  // namespace

std::vector<BatchCase> read_case_table(const fs::path& table) {
  const std::vector<std::string> lines = lines_of(read_text_file(table));
  const auto where = [&](std::size_t i) { return table.string() + ":" + std::to_string(i + 1); };
  const std::vector<std::string> keys = fields_of(lines.front(), where(0));
  const auto name_column = std::find(keys.begin(), keys.end(), "case") - keys.begin();
  if (name_column == static_cast<std::ptrdiff_t>(keys.size())) {
    throw BadDataError(where(0) +
                       ": the header has no column 'case'; write for example: "
                       "case,ct,mask,label");
  }
  std::vector<BatchCase> cases;
  std::set<std::string> names;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    if (lines[i].empty()) continue;
    const std::vector<std::string> fields = fields_of(lines[i], where(i));
    if (fields.size() != keys.size()) {
      throw BadDataError(where(i) + ": " + std::to_string(fields.size()) +
                         " fields, but the header has " + std::to_string(keys.size()) +
                         "; put a field with a comma in quotes");
    }
    BatchCase one{fields[name_column], {}};
    const std::string flaw = flaw_of_case_name(one.name);
    if (!flaw.empty())
      throw BadDataError(where(i) + ": the case's name '" + one.name + "' " + flaw);
    if (!names.insert(one.name).second) {
      throw BadDataError(where(i) + ": case '" + one.name + "' is there twice");
    }
    for (std::size_t k = 0; k < keys.size(); ++k) {
      if (static_cast<std::ptrdiff_t>(k) == name_column || fields[k].empty()) continue;
      one.settings.push_back(keys[k] + "=" + resolved(keys[k], fields[k], table.parent_path()));
    }
    cases.push_back(std::move(one));
  }
  if (cases.empty()) throw BadDataError(table, "the table holds no case below its header");
  return cases;
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
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
