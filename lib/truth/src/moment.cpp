// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/moment.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "organbake/core/parallel.h"

namespace organbake {

void Moment::take(const std::vector<DrawnOrgan>& organs, const View& from,
                  const std::vector<Solid>& tools) {
  view = from;
  solids = tools;
  const RigidTransform& pose = view.camera.camera_from_world;
  bases.clear();
  for (const DrawnOrgan& organ : organs) bases.push_back(&organ.base);
  shells.resize(organs.size());
  for (std::size_t o = 0; o < shells.size(); ++o) {
    const std::vector<ShellMatrix>& world = organs[o].shell;
    std::vector<Columns>& placed = shells[o];
    placed.resize(world.size());
    constexpr std::size_t kGrain = 1 << 10;
    parallel_pieces(std::size_t{0}, world.size(), kGrain, [&](std::size_t first, std::size_t last) {
      for (std::size_t f = first; f < last; ++f) {
        ShellMatrix metric = pose.rotation * world[f];
        metric.col(0) += pose.translation;
        placed[f].topRows<3>() = metric.cast<float>();
        placed[f].row(3).setZero();
      }
    });
  }
}

bool Moment::faces_eye(std::size_t organ, const BoundPixel& point) const {
  const BaseLayer& base = *bases[organ];
  const int n = static_cast<int>(base.steps);
  const float step = 1 / static_cast<float>(n);
  const float* heights = &base.height_mm[std::size_t(point.face) * base.nodes_per_face()];
  const auto node = [&](int i, int j) {
    BoundPixel at;
    at.face = point.face;
    at.b1 = step * static_cast<float>(i), at.b2 = step * static_cast<float>(j);
    at.height_mm = heights[base_node_index(base.steps, static_cast<std::uint32_t>(i),
                                           static_cast<std::uint32_t>(j))];
    return place(organ, at);
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
