// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstring>

#include "organbake/formats/camera_files.h"

namespace organbake {

std::string point_cloud_ply(const std::vector<SparsePoint>& points) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\ncomment millimetres, LPS\nelement vertex " +
      std::to_string(points.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nend_header\n";
  for (const SparsePoint& point : points) {
    char place[3 * sizeof(float)];
    const Eigen::Vector3f rounded = point.place_mm.cast<float>();
    std::memcpy(place, rounded.data(), sizeof place);
    bytes.append(place, sizeof place);
    for (const std::uint8_t channel : point.srgb) bytes += static_cast<char>(channel);
  }
  return bytes;
}

}  // namespace organbake
