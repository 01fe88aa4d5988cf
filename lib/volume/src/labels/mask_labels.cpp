// SPDX-License-Identifier: GPL-3.0-or-later
// Which labels a text asks for, by number or name, and one mask of them out of a file whose
// segments lie in layers; and how much of a mask each label takes, and the box that it lies in.
#include "files/volume_files.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

std::string plain(const std::string& name) {
  std::string text;
  for (const char c : lower_case(name))
    if (c != '_' && c != '-' && c != ' ') text += c;
  return text;
}

// Nothing for what is no number.
std::optional<int> as_number(const std::string& text) {
  const std::size_t digits = text.starts_with('-') ? 1 : 0;
  if (text.size() == digits || text.find_first_not_of("0123456789", digits) != text.npos)
    return std::nullopt;
  const auto value = number_in<int>(text);
  if (value && *value >= 1 && *value <= kMostLabel) return value;
  throw UsageError("the label is " + text + "; it must be 1…" + std::to_string(kMostLabel) +
                   " (0 is the background)");
}

// A file may give its labels any numbers; voxels have but these.
const LabelName& checked(const LabelName& known, const std::string& file) {
  if (known.label >= 1 && known.label <= kMostLabel) return known;
  throw BadDataError(file + ": its label \"" + known.name + "\" has the number " +
                     std::to_string(known.label) + "; 1…" + std::to_string(kMostLabel) +
                     " are labels");
}

// Two of one name are a question, not the first of them.
std::optional<LabelName> only_one(const std::vector<LabelName>& names, const std::string& file,
                                  const std::function<bool(const LabelName&)>& is_it) {
  const auto first = std::find_if(names.begin(), names.end(), is_it);
  if (first == names.end()) return std::nullopt;
  const auto second = std::find_if(std::next(first), names.end(), [&](const LabelName& other) {
    return is_it(other) && (other.label != first->label || other.layer != first->layer);
  });
  if (second == names.end()) return checked(*first, file);
  throw BadDataError(file + ": the labels " + std::to_string(first->label) + " and " +
                     std::to_string(second->label) + " are both called \"" + second->name +
                     "\"; choose one by its number");
}

std::optional<LabelName> by_name(const std::string& text, const std::vector<LabelName>& names,
                                 const std::string& file) {
  const auto exactly = [&](const LabelName& known) { return known.name == text; };
  if (auto found = only_one(names, file, exactly)) return found;
  return only_one(names, file,
                  [&](const LabelName& known) { return plain(known.name) == plain(text); });
}

LabelName by_number(int label, const std::vector<LabelName>& names, const std::string& file) {
  const LabelName* found = nullptr;
  for (const LabelName& known : names) {
    if (known.label != label) continue;
    if (found && found->layer != known.layer)
      throw BadDataError(file + ": label " + std::to_string(label) +
                         " is in several layers of the mask; choose by name: " + label_list(names));
    found = &known;
  }
  return {label, "label " + std::to_string(label), found ? found->layer : 0};
}

std::optional<LabelName> one_label(const std::string& text, const std::vector<LabelName>& names,
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
std::pair<std::optional<LabelName>, std::size_t> first_label(std::span<const std::string> parts,
                                                             const std::vector<LabelName>& names,
                                                             const std::string& file) {
  constexpr std::size_t kMostCommas = 7;
  for (std::size_t count = std::min(parts.size(), kMostCommas + 1); count > 1; --count) {
    const std::string name = joined(parts.first(count), ",");
    if (auto named = by_name(name, names, file)) return {std::move(named), count};
  }
  return {one_label(parts[0], names, file), 1};
}

std::vector<std::string> texts_of(const std::vector<LabelName>& names) {
  std::vector<std::string> texts;
  for (const LabelName& known : names) texts.push_back(known.name);
  return texts;
}

void add(const LabelName& one, std::vector<LabelName>& chosen) {
  chosen.push_back(one);
  for (const int label : one.with) chosen.push_back({label, {}, one.layer});
}

std::string together(const std::vector<LabelName>& chosen) {
  std::vector<std::string> names;
  for (const LabelName& one : chosen)
    if (!one.name.empty()) names.push_back(one.name);
  return joined(names, " and ");
}

bool holds_numbers_only(const std::string& label) {
  return label.find_first_not_of("0123456789, ") == std::string::npos;
}

// The voxels of a layer that are `wanted`, or all of them, in their place in the mask.
void paint(const Volume& layer, const std::set<int>& wanted, const std::vector<LabelName>& chosen,
           Volume& mask) {
  const int becomes = chosen.empty() ? 0 : chosen.front().label;
  if (layer.is_real() || becomes > std::numeric_limits<std::int16_t>::max()) make_real(mask);
  with_values(layer, [&](const auto values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const int label = static_cast<int>(values[i]);
      if (label <= 0 || !(chosen.empty() || wanted.contains(label))) continue;
      set_value(mask, i, chosen.empty() ? label : becomes);
    }
  });
}

Volume empty_like(const Volume& layer) {
  Volume mask = layer;
  mask.reals = {};
  mask.voxels.assign(layer.voxel_count(), 0);
  return mask;
}

}  // namespace

std::vector<LabelName> chosen_labels(const std::string& text, const std::vector<LabelName>& names,
                                     const std::string& file) {
  // A name may hold a comma.
  std::vector<LabelName> chosen;
  if (const auto whole = one_label(trimmed(text), names, file)) {
    add(*whole, chosen);
    return chosen;
  }
  const std::vector<std::string> parts = parts_of(text);
  for (std::size_t at = 0; at < parts.size();) {
    const auto first = first_label(std::span(parts).subspan(at), names, file);
    const std::optional<LabelName>& one = first.first;
    if (!one) {
      const std::string meant = suggestion(parts[at], texts_of(names));
      throw BadDataError(file + ": the mask has no label \"" + parts[at] + "\"" +
                         (names.empty()   ? "; its labels have no names, give a number"
                          : meant.empty() ? "; it holds " + label_list(names)
                                          : meant + " It holds " + label_list(names)));
    }
    const auto same = [&](const LabelName& c) {
      return c.label == one->label && c.layer == one->layer;
    };
    if (std::none_of(chosen.begin(), chosen.end(), same)) add(*one, chosen);
    at += first.second;
  }
  if (chosen.empty()) throw UsageError("the label is empty; give a number or a name");
  return chosen;
}

void choose_label(Volume& mask, const VolumeReadOptions& options, const std::string& file) {
  const std::vector<LabelName> chosen = chosen_labels(options.label, mask.label_names, file);
  mask.chosen_label = chosen.front().label;
  mask.chosen_name = together(chosen);
  if (chosen.size() == 1) return;
  std::set<int> there;
  for (const LabelCount& count : count_labels(mask)) there.insert(count.label);
  for (const LabelName& one : chosen) {
    // Of a region's labels not every case has each.
    if (!there.contains(one.label) && !one.name.empty()) throw_label_absent(mask, one.label);
    with_values(mask, [&](auto values) {
      using Value = typename decltype(values)::value_type;
      std::replace(values.begin(), values.end(), static_cast<Value>(one.label),
                   static_cast<Value>(mask.chosen_label));
    });
  }
}

Volume read_layers(std::int64_t layers, const VolumeReadOptions& options, const std::string& file,
                   const std::vector<LabelName>& names,
                   const std::function<Volume(std::int64_t)>& read_one) {
  std::vector<LabelName> chosen;
  if (!options.label.empty()) chosen = chosen_labels(options.label, names, file);
  for (const LabelName& one : chosen) {
    if (std::any_of(names.begin(), names.end(),
                    [&](const LabelName& known) { return known.label == one.label; }))
      continue;
    throw BadDataError(file + ": the mask has no " + one.name + "; it holds " + label_list(names));
  }
  std::optional<Volume> mask;
  for (std::int64_t layer = 0; layer < layers; ++layer) {
    std::set<int> wanted;
    for (const LabelName& one : chosen)
      if (one.layer == layer) wanted.insert(one.label);
    if (wanted.empty() && !chosen.empty()) continue;
    Volume read = read_one(layer);
    make_labels(read);
    if (!mask) mask = empty_like(read);
    if (!same_grid(*mask, read))
      throw BadDataError(file + ": its masks lie on different grids; choose one of them");
    paint(read, wanted, chosen, *mask);
  }
  if (!mask)
    throw BadDataError(file +
                       ": the segment lies in a layer that the file doesn't have; save it "
                       "again");
  if (!chosen.empty()) {
    mask->chosen_label = chosen.front().label;
    mask->chosen_name = together(chosen);
  }
  return std::move(*mask);
}

Volume read_separate_masks(const VolumeReadOptions& options, const std::string& file,
                           const std::vector<LabelName>& names, const std::string& advice,
                           const std::function<Volume(std::int64_t)>& read_one) {
  const bool by_number = !options.label.empty() && holds_numbers_only(options.label);
  // Channels without names are asked for as such; another name may mean labels over time.
  const bool by_other_name = !options.label.empty() && options.label_names.empty() &&
                             names.front().name.starts_with("channel ") &&
                             options.label.find("channel") == std::string::npos;
  if ((by_number || by_other_name) && names.size() > 1) throw BadDataError(file + ": " + advice);
  VolumeReadOptions asked = options;
  if (by_number) asked.label = names.front().name;
  const auto layers = static_cast<std::int64_t>(names.size());
  Volume mask = read_layers(layers, asked, file, names, [&](std::int64_t layer) {
    Volume one = read_one(layer);
    make_labels(one);
    Volume painted = empty_like(one);
    const int number = names[static_cast<std::size_t>(layer)].label;
    for (std::size_t i = 0; i < painted.voxels.size(); ++i) {
      const bool in = one.is_real() ? one.reals[i] > 0 : one.voxels[i] > 0;
      if (in) painted.voxels[i] = static_cast<std::int16_t>(number);
    }
    return painted;
  });
  mask.label_names = names;
  return mask;
}

namespace {

struct LabelBounds {
  std::size_t voxels = 0;
  Eigen::Vector3i low, high;

  void add(const Eigen::Vector3i& first, const Eigen::Vector3i& last, std::size_t count) {
    low = voxels == 0 ? first : low.cwiseMin(first);
    high = voxels == 0 ? last : high.cwiseMax(last);
    voxels += count;
  }
};

// By runs along a row: a mask has few of them, whatever its size.
std::map<int, LabelBounds> bounds_by_label(const Volume& mask) {
  std::vector<std::map<int, LabelBounds>> slices(static_cast<std::size_t>(mask.size[2]));
  with_values(mask, [&](const auto values) {
    const std::size_t voxels = static_cast<std::size_t>(mask.size[0]) * mask.size[1];
    parallel_for(0, mask.size[2], [&](int k) {
      auto row = values.data() + static_cast<std::size_t>(k) * voxels;
      for (int j = 0; j < mask.size[1]; ++j, row += mask.size[0]) {
        for (int i = 0, end = 0; i < mask.size[0]; i = end) {
          for (end = i + 1; end < mask.size[0] && row[end] == row[i];) ++end;
          if (!std::isfinite(static_cast<float>(row[i])) || row[i] == 0) continue;
          slices[k][static_cast<int>(row[i])].add({i, j, k}, {end - 1, j, k}, end - i);
        }
      }
    });
  });
  std::map<int, LabelBounds> found;
  for (const auto& slice : slices)
    for (const auto& [label, part] : slice) found[label].add(part.low, part.high, part.voxels);
  return found;
}

// Of the world, round the voxels between two indices.
Region world_box(const Volume& grid, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Region box = {Eigen::Vector3d::Constant(1e30), Eigen::Vector3d::Constant(-1e30)};
  for (const Eigen::Vector3d& index : corners_of(low, high)) {
    box.min_mm = box.min_mm.cwiseMin(grid.world_from_index(index));
    box.max_mm = box.max_mm.cwiseMax(grid.world_from_index(index));
  }
  return box;
}

std::string point(const Eigen::Vector3d& p) {
  return "(" + to_text(p.x(), 1) + ", " + to_text(p.y(), 1) + ", " + to_text(p.z(), 1) + ")";
}

}  // namespace

bool looks_like_mask(const Volume& volume) {
  constexpr int kMostLabels = 1000;  // HU spread over thousands, and below 0
  if (!volume.label_names.empty()) return true;
  const ValueRange range = value_range(volume);
  const auto no_label = [](float value) { return value != std::floor(value); };
  return range.min >= 0 && range.max <= kMostLabels &&
         std::none_of(volume.reals.begin(), volume.reals.end(),
                      [&](float value) { return !std::isnan(value) && no_label(value); });
}

std::vector<LabelFigures> label_figures(const Volume& mask) {
  std::vector<LabelFigures> all;
  const double voxel_ml = mask.spacing_mm.prod() / 1000;
  for (const auto& [label, bounds] : bounds_by_label(mask)) {
    LabelFigures figures;
    figures.label = label;
    for (const LabelName& known : mask.label_names)
      if (known.label == label) figures.name = known.name;
    figures.voxels = bounds.voxels;
    figures.volume_ml = static_cast<double>(bounds.voxels) * voxel_ml;
    const Region box = world_box(mask, bounds.low.cast<double>(), bounds.high.cast<double>());
    figures.min_mm = box.min_mm;
    figures.max_mm = box.max_mm;
    all.push_back(figures);
  }
  return all;
}

std::string label_line(const LabelFigures& figures) {
  return std::to_string(figures.label) + (figures.name.empty() ? "" : " " + figures.name) + ": " +
         to_text(figures.volume_ml, 1) + " ml, " + std::to_string(figures.voxels) + " voxels, " +
         point(figures.min_mm) + "…" + point(figures.max_mm) + " mm";
}

std::vector<LabelCount> count_labels(const Volume& mask) {
  std::vector<LabelCount> labels;
  for (const auto& [label, bounds] : bounds_by_label(mask))
    labels.push_back({label, bounds.voxels});
  return labels;
}

LabelBox bounding_box(const Volume& mask, int label) {
  const auto all = bounds_by_label(mask);
  const auto found = all.find(label);
  LabelBox box;
  if (found == all.end()) return box;
  const LabelBounds& bounds = found->second;
  box.label_voxels = bounds.voxels;
  for (int axis = 0; axis < 3; ++axis) {
    box.first[axis] = bounds.low[axis];
    box.size[axis] = bounds.high[axis] - bounds.low[axis] + 1;
  }
  return box;
}

Region region_around(const Volume& mask, const LabelBox& box) {
  constexpr double kAround_voxels = 2;
  const Eigen::Vector3d first(box.first[0], box.first[1], box.first[2]);
  const Eigen::Vector3d last =
      first + Eigen::Vector3d(box.size[0] - 1, box.size[1] - 1, box.size[2] - 1);
  return world_box(mask, first.array() - kAround_voxels, last.array() + kAround_voxels);
}

}  // namespace organbake
