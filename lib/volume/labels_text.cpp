// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/labels_text.h"

#include <algorithm>

#include "core/error.h"

namespace organbake {

void throw_label_absent(const Volume& mask, int label) {
  const std::vector<LabelCount> labels = count_labels(mask);
  std::string message = "the mask has no label " + std::to_string(label);
  if (labels.empty()) throw BadDataError(message + "; it is empty");
  constexpr std::size_t kShown = 40;
  message += "; it holds ";
  for (std::size_t i = 0; i < std::min(labels.size(), kShown); ++i) {
    message += (i ? ", " : "") + std::to_string(labels[i].label);
  }
  if (labels.size() > kShown) {
    message += " … " + std::to_string(labels.back().label) + " (" + std::to_string(labels.size()) +
               " labels; is this a CT?)";
  }
  throw BadDataError(message);
}

}  // namespace organbake
