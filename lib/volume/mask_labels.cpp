// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/mask_labels.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/nearest_name.h"
#include "volume/header_text.h"
#include "volume/label_names_file.h"

namespace organbake {
namespace {

constexpr int kMostLabel = 32767;

std::string plain(const std::string& name) {
  std::string text;
  for (const char c : lower_case(name)) {
    if (c != '_' && c != '-' && c != ' ') text += c;
  }
  return text;
}

std::optional<int> as_number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || text.empty()) return std::nullopt;
  if (error != std::errc() || value < 1 || value > kMostLabel) {
    throw UsageError("the label is " + text + "; it must be 1…32767 (0 is the background)");
  }
  return value;
}

// A file may give its labels any numbers; voxels have but these.
ChosenLabel chosen_of(const LabelName& known, const std::string& file) {
  if (known.label < 1 || known.label > kMostLabel)
    throw BadDataError(file + ": its label \"" + known.name + "\" has the number " +
                       std::to_string(known.label) + "; 1…32767 are labels");
  return {known.label, known.layer, known.name};
}

std::optional<ChosenLabel> by_name(const std::string& text, const std::vector<LabelName>& names,
                                   const std::string& file) {
  for (const LabelName& known : names) {
    if (known.name == text) return chosen_of(known, file);
  }
  for (const LabelName& known : names) {
    if (plain(known.name) == plain(text)) return chosen_of(known, file);
  }
  return std::nullopt;
}

ChosenLabel by_number(int label, const std::vector<LabelName>& names, const std::string& file) {
  const LabelName* found = nullptr;
  for (const LabelName& known : names) {
    if (known.label != label) continue;
    if (found && found->layer != known.layer) {
      throw BadDataError(file + ": label " + std::to_string(label) +
                         " is in several layers of the mask; choose by name: " + label_list(names));
    }
    found = &known;
  }
  return {label, found ? found->layer : 0, "label " + std::to_string(label)};
}

std::optional<ChosenLabel> one_label(const std::string& text, const std::vector<LabelName>& names,
                                     const std::string& file) {
  if (auto named = by_name(text, names, file)) return named;
  if (const auto number = as_number(text)) return by_number(*number, names, file);
  return std::nullopt;
}

std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    const std::string part = trimmed(text.substr(at, comma - at));
    if (!part.empty()) parts.push_back(part);
    at = comma + 1;
  }
  return parts;
}

// The label that the first of the parts names, or, as a name may hold commas, the first few of
// them; and how many that took.
std::pair<std::optional<ChosenLabel>, std::size_t> first_label(std::span<const std::string> parts,
                                                               const std::vector<LabelName>& names,
                                                               const std::string& file) {
  constexpr std::size_t kMostCommas = 7;
  for (std::size_t count = std::min(parts.size(), kMostCommas + 1); count > 1; --count) {
    std::string joined = parts[0];
    for (const std::string& part : parts.subspan(1, count - 1)) joined += "," + part;
    if (auto named = by_name(joined, names, file)) return {std::move(named), count};
  }
  return {one_label(parts[0], names, file), 1};
}

std::vector<std::string> texts_of(const std::vector<LabelName>& names) {
  std::vector<std::string> texts;
  for (const LabelName& known : names) texts.push_back(known.name);
  return texts;
}

std::string together(const std::vector<ChosenLabel>& chosen) {
  std::string text;
  for (const ChosenLabel& one : chosen) text += (text.empty() ? "" : " and ") + one.name;
  return text;
}

}  // namespace

std::vector<ChosenLabel> chosen_labels(const std::string& text, const std::vector<LabelName>& names,
                                       const std::string& file) {
  // A name may hold a comma.
  if (const auto whole = one_label(trimmed(text), names, file)) return {*whole};
  std::vector<ChosenLabel> chosen;
  const std::vector<std::string> parts = parts_of(text);
  for (std::size_t at = 0; at < parts.size();) {
    const auto first = first_label(std::span(parts).subspan(at), names, file);
    const std::optional<ChosenLabel>& one = first.first;
    if (!one) {
      throw BadDataError(file + ": the mask has no label \"" + parts[at] + "\"; " +
                         (names.empty() ? "its labels have no names, give a number"
                                        : "it holds " + label_list(names)) +
                         suggestion(parts[at], texts_of(names)));
    }
    const auto same = [&](const ChosenLabel& c) {
      return c.label == one->label && c.layer == one->layer;
    };
    if (std::none_of(chosen.begin(), chosen.end(), same)) chosen.push_back(*one);
    at += first.second;
  }
  if (chosen.empty()) throw UsageError("the label is empty; give a number or a name");
  return chosen;
}

void choose_label(Volume& mask, const VolumeReadOptions& options, const std::string& file) {
  const std::vector<ChosenLabel> chosen = chosen_labels(options.label, mask.label_names, file);
  mask.chosen_label = chosen.front().label;
  mask.chosen_name = together(chosen);
  if (chosen.size() == 1) return;
  std::set<int> there;
  for (const LabelCount& count : count_labels(mask)) there.insert(count.label);
  std::vector<bool> wanted(kMostLabel + 1, false);
  for (const ChosenLabel& one : chosen) {
    if (!there.contains(one.label)) throw_label_absent(mask, one.label);
    wanted[static_cast<std::size_t>(one.label)] = true;
  }
  for (std::int16_t& voxel : mask.voxels) {
    if (voxel > 0 && wanted[static_cast<std::size_t>(voxel)]) {
      voxel = static_cast<std::int16_t>(mask.chosen_label);
    }
  }
}

Volume read_layers(std::int64_t layers, const VolumeReadOptions& options, const std::string& file,
                   const std::vector<LabelName>& names,
                   const std::function<Volume(std::int64_t)>& read_one) {
  std::vector<ChosenLabel> chosen;
  if (!options.label.empty()) chosen = chosen_labels(options.label, names, file);
  for (const ChosenLabel& one : chosen) {
    if (std::any_of(names.begin(), names.end(),
                    [&](const LabelName& known) { return known.label == one.label; })) {
      continue;
    }
    throw BadDataError(file + ": the mask has no " + one.name + "; it holds " + label_list(names));
  }
  std::optional<Volume> mask;
  for (std::int64_t layer = 0; layer < layers; ++layer) {
    std::vector<bool> wanted(kMostLabel + 1, chosen.empty());
    bool any = chosen.empty();
    for (const ChosenLabel& one : chosen) {
      if (one.layer != layer) continue;
      wanted[static_cast<std::size_t>(one.label)] = any = true;
    }
    if (!any) continue;
    Volume read = read_one(layer);
    if (!mask) {
      mask = read;
      std::fill(mask->voxels.begin(), mask->voxels.end(), std::int16_t{0});
    }
    for (std::size_t i = 0; i < read.voxels.size(); ++i) {
      const std::int16_t voxel = read.voxels[i];
      if (voxel <= 0 || !wanted[static_cast<std::size_t>(voxel)]) continue;
      mask->voxels[i] = chosen.empty() ? voxel : static_cast<std::int16_t>(chosen.front().label);
    }
  }
  if (!mask) {
    throw BadDataError(file +
                       ": the segment lies in a layer that the file doesn't have; save it "
                       "again");
  }
  if (!chosen.empty()) {
    mask->chosen_label = chosen.front().label;
    mask->chosen_name = together(chosen);
  }
  return std::move(*mask);
}

}  // namespace organbake
