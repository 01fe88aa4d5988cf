// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/label_names_file.h"

#include <algorithm>

#include "organbake/core/error.h"

namespace organbake {
namespace {

constexpr std::size_t kShown = 40;

std::string with_name(int label, const std::vector<LabelName>& names) {
  for (const LabelName& known : names) {
    if (known.label == label) return std::to_string(label) + " " + known.name;
  }
  return std::to_string(label);
}

}  // namespace

std::string label_list(const std::vector<LabelName>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) {
    text += (i ? ", " : "") + std::to_string(names[i].label) + " " + names[i].name;
  }
  return names.size() > kShown ? text + ", …" : text;
}

void throw_label_absent(const Volume& mask, int label) {
  const std::vector<LabelCount> labels = count_labels(mask);
  std::string message = "the mask has no label " + std::to_string(label);
  if (labels.empty()) throw BadDataError(message + "; it is empty");
  message += "; it holds ";
  for (std::size_t i = 0; i < std::min(labels.size(), kShown); ++i) {
    message += (i ? ", " : "") + with_name(labels[i].label, mask.label_names);
  }
  if (labels.size() > kShown) {
    message += " … " + std::to_string(labels.back().label) + " (" + std::to_string(labels.size()) +
               " labels; is this a CT?)";
  }
  throw BadDataError(message);
}

}  // namespace organbake
