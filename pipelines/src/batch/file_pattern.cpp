// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/file_pattern.h"

#include <fnmatch.h>

#include <algorithm>
#include <set>

#include "organbake/core/error.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

bool has_wildcard(const std::string& text) { return text.find_first_of("*?[") != text.npos; }

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    entries.push_back(at->path());
  }
  if (error) throw IoError::reading(folder, error.message());
  return entries;
}

// A link to a folder is followed only when the pattern names it: "**" would run in circles.
bool is_folder_to_enter(const fs::path& path) {
  return fs::is_directory(fs::symlink_status(path)) && path.filename().string().front() != '.';
}

using Segments = std::vector<std::string>;

void collect(const fs::path& folder, const Segments& segments, std::size_t at,
             std::set<std::string>& found) {
  const bool last = at + 1 == segments.size();
  if (segments[at] == "**") {
    if (!last) collect(folder, segments, at + 1, found);
    for (const fs::path& entry : entries_of(folder)) {
      if (is_folder_to_enter(entry)) collect(entry, segments, at, found);
      if (last && fs::is_regular_file(entry)) found.insert(entry.string());
    }
    return;
  }
  for (const fs::path& entry : entries_of(folder)) {
    const std::string name = entry.filename().string();
    if (::fnmatch(segments[at].c_str(), name.c_str(), FNM_PERIOD) != 0) continue;
    if (last) {
      found.insert(entry.string());
    } else if (fs::is_directory(entry)) {
      collect(entry, segments, at + 1, found);
    }
  }
}

}  // namespace

bool is_file_pattern(const std::string& word) {
  std::error_code ignored;
  return has_wildcard(word) && !fs::exists(word, ignored);
}

fs::path folder_of_pattern(const std::string& pattern) {
  fs::path folder;
  for (const fs::path& part : fs::path(pattern).parent_path()) {
    if (has_wildcard(part.string())) break;
    folder /= part;
  }
  return folder.empty() ? fs::path(".") : folder;
}

std::vector<fs::path> files_matching(const std::string& pattern) {
  const fs::path folder = folder_of_pattern(pattern);
  if (!fs::is_directory(folder)) throw NoInputError(pattern, folder.string() + " is no folder");
  const fs::path rest = fs::path(pattern).lexically_relative(folder);
  const Segments segments(rest.begin(), rest.end());
  std::set<std::string> found;
  collect(folder, segments, 0, found);
  if (found.empty()) throw NoInputError(pattern, "no file has such a name");
  return {found.begin(), found.end()};
}

}  // namespace organbake
