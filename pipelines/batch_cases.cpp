// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/batch_cases.h"

#include <algorithm>
#include <cstdio>
#include <set>

#include "core/error.h"
#include "core/files.h"
#include "pipelines/recipe.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Why a text can't name a case's folder; empty when it can.
std::string flaw_of_name(const std::string& name) {
  if (name.empty()) return "is empty";
  if (name.front() == '.' || name.front() == '-') return "begins with '.' or '-'";
  constexpr std::size_t kLongest = 200;
  if (name.size() > kLongest) return "is longer than 200 bytes";
  for (const unsigned char c : name) {
    if (c == '/') return "holds a '/'";
    if (c < 0x20 || c == 0x7F) return "holds a control character";
  }
  return {};
}

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

bool is_input(const std::string& key) {
  const auto& inputs = recipe_inputs();
  return std::any_of(inputs.begin(), inputs.end(),
                     [&](const RecipeInput& input) { return input.name == key; });
}

// A relative path of an input, seen from the table's folder.
std::string resolved(const std::string& key, const std::string& value, const fs::path& folder) {
  if (!is_input(key) || fs::path(value).is_absolute()) return value;
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
    const std::string flaw = flaw_of_name(one.name);
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

std::vector<BatchCase> cases_of_files(const std::vector<std::string>& files,
                                      const std::string& input) {
  if (!is_input(input)) {
    std::string known;
    for (const RecipeInput& one : recipe_inputs()) known += (known.empty() ? "" : ", ") + one.name;
    throw UsageError("--as " + input + " is no input of a recipe; the inputs are " + known);
  }
  std::vector<BatchCase> cases;
  std::set<std::string> names;
  for (const std::string& file : files) {
    std::string name = fs::path(file).lexically_normal().filename().string();
    if (name.empty()) name = fs::path(file).lexically_normal().parent_path().filename().string();
    name = name.substr(0, name.find('.', 1));  // also of scan.nii.gz
    const std::string flaw = flaw_of_name(name);
    if (!flaw.empty()) {
      throw UsageError(file + ": its name '" + name + "' " + flaw + "; use a table of cases");
    }
    if (!names.insert(name).second) {
      throw UsageError(file + ": another file is called '" + name +
                       "', too; use a table that names the cases");
    }
    cases.push_back({name, {input + "=" + file}});
  }
  return cases;
}

Shard parse_shard(const std::string& text) {
  Shard shard;
  int end = 0;
  const int fields = std::sscanf(text.c_str(), "%zu/%zu%n", &shard.index, &shard.count, &end);
  constexpr std::size_t kMost = 1'000'000;
  if (fields != 2 || end != static_cast<int>(text.size()) || shard.index < 1 ||
      shard.index > shard.count || shard.count > kMost) {
    throw UsageError("--shard " + text + " is no shard; write I/N with 1 ≤ I ≤ N, for example 2/8");
  }
  return shard;
}

std::vector<BatchCase> cases_of_shard(const std::vector<BatchCase>& cases, const Shard& shard) {
  std::vector<BatchCase> mine;
  for (std::size_t i = shard.index - 1; i < cases.size(); i += shard.count) {
    mine.push_back(cases[i]);
  }
  return mine;
}

}  // namespace organbake
