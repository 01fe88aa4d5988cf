// SPDX-License-Identifier: Apache-2.0
#include "truth/skin_facing.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace organbake {

bool faces_eye(const Moment& moment, std::size_t organ, const BoundPixel& point) {
  const BaseLayer& base = *moment.bases[organ];
  const int n = static_cast<int>(base.steps);
  const float step = 1 / static_cast<float>(n);
  const float* heights = &base.height_mm[std::size_t(point.face) * base.nodes_per_face()];
  const auto node = [&](int i, int j) {
    BoundPixel at;
    at.face = point.face;
    at.b1 = step * static_cast<float>(i), at.b2 = step * static_cast<float>(j);
    at.height_mm = heights[base_node_index(base.steps, static_cast<std::uint32_t>(i),
                                           static_cast<std::uint32_t>(j))];
    return moment.place(organ, at);
  };
  const float u = point.b1 * static_cast<float>(n), v = point.b2 * static_cast<float>(n);
  const int i = std::clamp(static_cast<int>(u), 0, n - 1),
            j = std::clamp(static_cast<int>(v), 0, n - 1 - i);
  const bool upper = u - static_cast<float>(i) + v - static_cast<float>(j) > 1 && i + j + 2 <= n;
  const Eigen::Vector3f b = node(i + 1, j), c = node(i, j + 1),
                        a = upper ? node(i + 1, j + 1) : node(i, j);
  const Eigen::Vector3f normal = upper ? (c - a).cross(b - a) : (b - a).cross(c - a);
  return normal.dot(a + b + c) < 0;
}

}  // namespace organbake
