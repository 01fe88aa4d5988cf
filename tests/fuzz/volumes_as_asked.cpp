// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/volumes_as_asked.h"

#include <algorithm>
#include <string>

#include "organbake/volume/read_volume.h"

namespace organbake {
namespace {

Region middle_of(const Volume& volume) {
  const Eigen::Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  const Eigen::Vector3d a = volume.world_from_index(0.4 * last);
  const Eigen::Vector3d b = volume.world_from_index(0.6 * last);
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

std::string first_labels(const Volume& mask) {
  constexpr std::size_t kMost = 2;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, mask.label_names.size()); ++i)
    text += (i ? "," : "") + mask.label_names[i].name;
  if (!mask.label_names.empty()) return text;
  std::size_t count = 0;
  for (const LabelCount& one : count_labels(mask))
    if (one.label > 0 && count++ < kMost)
      text += (text.empty() ? "" : ",") + std::to_string(one.label);
  return text;
}

}  // namespace

void read_all_and_a_part(const std::filesystem::path& path) {
  const Volume volume = read_volume(path, {.any_time = true});
  read_volume(path, {.region = middle_of(volume), .time = static_cast<int>(volume.time_points)});
}

void read_mask_and_labels(const std::filesystem::path& path) {
  const Volume mask = read_volume(path, {.any_time = true, .is_mask = true});
  const std::string labels = first_labels(mask);
  if (labels.empty()) return;
  read_volume(path,
              {.region = middle_of(mask), .any_time = true, .label = labels, .is_mask = true});
}

}  // namespace organbake
