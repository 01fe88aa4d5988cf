// SPDX-License-Identifier: GPL-3.0-or-later
// Names of labels from the tables that ITK-SNAP, 3D Slicer, atlases and nnU-Net write. In, a text
// or JSON; out, numbers and names.
#include "organbake/volume/read_volume.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <span>

#include "files/volume_files.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

// A table's row in columns that `mark` parts, without the quotes round them.
std::vector<std::string> columns_of(const std::string& line, char mark) {
  std::vector<std::string> columns(1);
  bool quoted = false;
  for (const char c : line) {
    quoted ^= c == '"';
    if (c == mark && !quoted) {
      columns.emplace_back();
    } else if (c != '"') {
      columns.back() += c;
    }
  }
  for (std::string& column : columns) column = trimmed(column);
  return columns;
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

// What parts a table's columns; none where blanks do, as in most.
std::optional<char> mark_of(const std::string& line) {
  const auto quotes = std::count(line.begin(), line.end(), '"');
  if (columns_of(line, ';').size() > 1) return ';';
  if ((quotes > 2 || line.starts_with('"')) && columns_of(line, ',').size() > 1) return ',';
  return std::nullopt;
}

// Which columns of a table have the number and the name, where its first row says so.
struct LabelColumns {
  std::size_t number = 0;
  std::optional<std::size_t> name;
};

std::optional<LabelColumns> titles_of(const std::string& line) {
  std::vector<std::string> titles = columns_of(line, line.find(';') < line.size() ? ';' : ',');
  if (titles.size() < 2) return std::nullopt;
  LabelColumns found;
  bool numbered = false;
  for (std::size_t i = 0; i < titles.size(); ++i) {
    const std::string title = lower_case(titles[i]);
    if (number_in<int>(title)) return std::nullopt;
    const bool number = title == "index" || title == "id" || title == "number" ||
                        title == "value" || title == "key" || (title == "label" && i == 0);
    if (number && !numbered) found.number = i;
    numbered |= number;
    if (!found.name && !number &&
        (title.find("name") != title.npos || title == "structure" || title == "region" ||
         title == "organ" || title == "label"))
      found.name = i;
  }
  return numbered || found.name ? std::optional(found) : std::nullopt;
}

// Of several texts in a row, as a short form and the whole word, the longest is the name.
std::optional<LabelName> label_of_row(const std::vector<std::string>& row,
                                      const LabelColumns& columns) {
  if (columns.number >= row.size()) return std::nullopt;
  const std::optional<int> label = number_in<int>(row[columns.number]);
  if (!label) return std::nullopt;
  std::string name;
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (i == columns.number || (columns.name && i != *columns.name)) continue;
    if ((columns.name || !number_in<double>(row[i])) && row[i].size() > name.size()) name = row[i];
  }
  if (name.empty()) return std::nullopt;
  return LabelName{*label, name};
}

// What is left of a line without its numbers is the name, in quotes or not.
std::optional<LabelName> label_of(const std::string& line, const LabelColumns& columns) {
  if (const auto mark = mark_of(line)) return label_of_row(columns_of(line, *mark), columns);
  if (columns.name) return label_of_row(columns_of(line, ','), columns);
  int label = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), label);
  if (error != std::errc()) return std::nullopt;
  const std::string rest = line.substr(static_cast<std::size_t>(end - line.data()));
  const std::size_t open = rest.find('"'), close = rest.rfind('"');
  if (open != close) return LabelName{label, trimmed(rest.substr(open + 1, close - open - 1))};
  std::string name;
  for (const std::string& word : words_of(rest)) {
    if (number_in<double>(word) || word == "=" || word == ":") continue;
    name += (name.empty() ? "" : " ") + word;
  }
  if (name.empty()) return std::nullopt;
  return LabelName{label, name};
}

using Json = nlohmann::json;

std::vector<int> numbers_of(const Json& json) {
  std::vector<int> labels;
  const auto add = [&](const Json& number) {
    if (number.is_number_integer() && number >= 0 && number <= kMostLabel)
      labels.push_back(number.get<int>());
  };
  add(json);
  if (json.is_array()) std::for_each(json.begin(), json.end(), add);
  if (json.is_array() && labels.size() != json.size()) labels.clear();
  return labels;
}

// An entry of either version: name and number, or number and name.
LabelName label_of_entry(const std::string& key, const Json& json,
                         const std::filesystem::path& file) {
  LabelName label{0, key};
  std::vector<int> labels = numbers_of(json);
  const auto number = number_in<int>(key);
  if (json.is_string() && number) return {*number, json.get<std::string>()};
  if (labels.empty())
    throw BadDataError(file, "its label \"" + key + "\" is " + json.dump().substr(0, 80) +
                                 "; a number, or a list of them, is needed");
  label.label = labels.front();
  label.with.assign(labels.begin() + 1, labels.end());
  return label;
}

std::vector<LabelName> names_of_dataset(const std::filesystem::path& file) {
  constexpr std::uintmax_t kMostBytes = 1 << 24;
  const Json json = Json::parse(read_text_file(file, kMostBytes), nullptr, false);
  if (json.is_discarded()) throw BadDataError(file, "is no sound JSON");
  if (!json.is_object() || !json.contains("labels") || !json["labels"].is_object())
    throw BadDataError(file, "has no \"labels\", as nnU-Net's dataset.json has them");
  std::vector<LabelName> names;
  for (const auto& [key, value] : json["labels"].items()) {
    LabelName label = label_of_entry(key, value, file);
    if (label.label > 0) names.push_back(std::move(label));
  }
  std::stable_sort(names.begin(), names.end(),
                   [](const LabelName& a, const LabelName& b) { return a.label < b.label; });
  return names;
}

constexpr std::size_t kShown = 40;

std::string with_name(int label, const std::vector<LabelName>& names) {
  for (const LabelName& known : names)
    if (known.label == label) return std::to_string(label) + " " + known.name;
  return std::to_string(label);
}

}  // namespace

std::vector<LabelName> read_label_names(const std::filesystem::path& file) {
  HeaderText text(file);
  std::vector<LabelName> names;
  LabelColumns columns;
  int number = 0;
  bool titled = false;
  for (std::string line; text.next_line(line);) {
    ++number;
    line = trimmed(line);
    if (names.empty() && line.starts_with('{')) {
      names = names_of_dataset(file);
      break;
    }
    if (line.empty() || line[0] == '#') continue;
    if (const auto titles = titles_of(line); titles && names.empty() && !titled) {
      columns = *titles;
      titled = true;
      continue;
    }
    const auto label = label_of(line, columns);
    if (!label)
      throw BadDataError(file, "line " + std::to_string(number) + " \"" + line.substr(0, 80) +
                                   "\" is no label; a number and a name are needed, as ITK-SNAP "
                                   "and 3D Slicer write them");
    if (label->label > 0) names.push_back(*label);
  }
  if (names.empty()) throw BadDataError(file, "names no label");
  return names;
}

std::string label_list(const std::vector<LabelName>& names) {
  const std::string text =
      joined(std::span(names).first(std::min(names.size(), kShown)), ", ",
             [](const LabelName& one) { return std::to_string(one.label) + " " + one.name; });
  return names.size() > kShown ? text + ", …" : text;
}

std::string name_of_label(const Volume& mask, int label) {
  const bool named = label == mask.chosen_label && !mask.chosen_name.empty();
  return named ? mask.chosen_name : "label " + std::to_string(label);
}

void throw_label_absent(const Volume& mask, int label) {
  const std::vector<LabelCount> labels = count_labels(mask);
  std::string message = "the mask has no label " + std::to_string(label);
  if (labels.empty()) throw BadDataError(message + "; it is empty");
  message += "; it holds " +
             joined(std::span(labels).first(std::min(labels.size(), kShown)), ", ",
                    [&](const LabelCount& one) { return with_name(one.label, mask.label_names); });
  if (labels.size() > kShown)
    message += " … " + std::to_string(labels.back().label) + " (" + std::to_string(labels.size()) +
               " labels; is this a CT?)";
  throw BadDataError(message);
}

}  // namespace organbake
