// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/label_names_file.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>

#include "core/error.h"
#include "volume/header_text.h"

namespace organbake {
namespace {

bool is_number(const std::string& word) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

std::vector<std::string> words_of(const std::string& line) {
  std::vector<std::string> words;
  for (std::size_t at = 0; (at = line.find_first_not_of(" \t,", at)) != std::string::npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t,", at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

// What is left of a line without its numbers is the name, in quotes or not.
std::optional<LabelName> label_of(const std::string& line) {
  int label = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), label);
  if (error != std::errc()) return std::nullopt;
  const std::string rest = line.substr(static_cast<std::size_t>(end - line.data()));
  const std::size_t open = rest.find('"'), close = rest.rfind('"');
  if (open != close) return LabelName{label, trimmed(rest.substr(open + 1, close - open - 1))};
  std::string name;
  for (const std::string& word : words_of(rest)) {
    if (is_number(word) || word == "=" || word == ":") continue;
    name += (name.empty() ? "" : " ") + word;
  }
  if (name.empty()) return std::nullopt;
  return LabelName{label, name};
}

}  // namespace

std::vector<LabelName> read_label_names(const std::filesystem::path& file) {
  HeaderText text(file);
  std::vector<LabelName> names;
  int number = 0;
  for (std::string line; text.next_line(line);) {
    ++number;
    line = trimmed(line);
    if (line.empty() || line[0] == '#') continue;
    const auto label = label_of(line);
    if (!label) {
      throw BadDataError(file, "line " + std::to_string(number) + " \"" + line.substr(0, 80) +
                                   "\" is no label; a number and a name are needed, as ITK-SNAP "
                                   "and 3D Slicer write them");
    }
    if (label->label > 0) names.push_back(*label);
  }
  if (names.empty()) throw BadDataError(file, "names no label");
  return names;
}

}  // namespace organbake
