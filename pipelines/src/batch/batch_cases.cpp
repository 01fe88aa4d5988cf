// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/batch_cases.h"

#include <algorithm>
#include <cstdio>
#include <set>

#include "documents/text_table.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/case_table.h"
#include "organbake/pipelines/file_pattern.h"
#include "organbake/pipelines/recipe.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// "scan.nii.gz" → "scan"; a folder's name has no ending, though it may hold points (a DICOM UID).
fs::path without_ending(const fs::path& path) {
  if (fs::is_directory(path)) return path;
  const fs::path bare = path.extension() == ".gz" || path.extension() == ".bz2"
                            ? path.parent_path() / path.stem()
                            : path;
  return bare.parent_path() / bare.stem();
}

std::string name_of_file(const fs::path& file) {
  const fs::path normal = file.lexically_normal();
  const fs::path named = normal.has_filename() ? normal : normal.parent_path();
  return without_ending(named).filename().string();
}

std::string name_of_match(const fs::path& file, const fs::path& folder) {
  std::string name = without_ending(file).lexically_relative(folder).generic_string();
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

struct NamedFile {
  std::string name;
  fs::path path;
};

std::vector<NamedFile> named_files(const std::vector<std::string>& words) {
  std::vector<NamedFile> files;
  for (const std::string& word : words) {
    if (!is_file_pattern(word)) {
      files.push_back({name_of_file(word), word});
      continue;
    }
    const fs::path folder = folder_of_pattern(word);
    for (const fs::path& file : files_matching(word)) {
      files.push_back({name_of_match(file, folder), file});
    }
  }
  return files;
}

void check_input_name(const std::string& input) {
  if (is_recipe_input(input)) return;
  std::string known;
  for (const RecipeInput& one : recipe_inputs()) known += (known.empty() ? "" : ", ") + one.name;
  throw UsageError("--as " + input + " is no input of a recipe; the inputs are " + known);
}

}  // namespace

std::string flaw_of_case_name(const std::string& name) {
  if (name.empty()) return "is empty";
  if (name.front() == '.' || name.front() == '-') return "begins with '.' or '-'";
  constexpr std::size_t kLongest = 200;
  if (name.size() > kLongest) return "is longer than 200 bytes";
  for (const unsigned char c : name) {
    if (c == '/') return "holds a '/'";
    if (c < 0x20 || c == 0x7F) return "holds a control character";
  }
  // What the batch itself writes beside its cases.
  for (const char* own :
       {"logs", "pictures", "cases.csv", "batch.json", "batch.csv", "batch.html"}) {
    if (name == own) return "is a name that the batch needs for itself";
  }
  return {};
}

std::vector<BatchCase> cases_of_words(const std::vector<std::string>& words,
                                      const std::string& input) {
  if (words.size() == 1 && is_table_name(words[0])) return read_case_table(words[0]);
  if (words.size() == 1 && lower_ending(words[0]).starts_with(".xls"))
    throw UsageError(words[0] + " is a workbook; save its sheet as CSV (.csv) and give that");
  check_input_name(input);
  std::vector<BatchCase> cases;
  std::set<std::string> names;
  for (const NamedFile& file : named_files(words)) {
    const std::string flaw = flaw_of_case_name(file.name);
    if (!flaw.empty()) {
      throw UsageError(file.path.string() + ": its name '" + file.name + "' " + flaw +
                       "; use a table of cases");
    }
    if (!names.insert(file.name).second) {
      throw UsageError(file.path.string() + ": another file is called '" + file.name +
                       "', too; use a table that names the cases");
    }
    cases.push_back({file.name, {input + "=" + file.path.string()}});
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
