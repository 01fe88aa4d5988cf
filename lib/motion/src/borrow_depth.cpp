// SPDX-License-Identifier: GPL-3.0-or-later
#include "borrow_depth.h"

#include <cmath>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr float kSure = 0.6F;  // confidence from which depth is lent
constexpr float kLent = 0.8F;  // share of it that arrives: tissue may have moved meanwhile

void lend(const SweptDepth& partner, const PosedCamera& from, const PosedCamera& to,
          SweptDepth& own) {
  const RigidTransform there_from_here = to.camera_from_world * from.camera_from_world.inverse();
  for (int y = 0; y < partner.depth.height; ++y)
    for (int x = 0; x < partner.depth.width; ++x) {
      const std::size_t k = partner.depth.index(x, y);
      const float confidence = kLent * partner.confidence.values[k];
      if (confidence < kLent * kSure) continue;
      const Eigen::Vector3d ray = unproject(from.intrinsics, {x + 0.5, y + 0.5});
      const Eigen::Vector3d point =
          there_from_here * Eigen::Vector3d(ray * partner.depth.values[k]);
      if (!(point.z() > 0)) continue;
      const Eigen::Vector2d pixel = project(to.intrinsics, point);
      if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < own.depth.width &&
            pixel.y() < own.depth.height))
        continue;
      const std::size_t at =
          own.depth.index(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
      if (own.confidence.values[at] >= confidence) continue;
      own.depth.values[at] = static_cast<float>(point.z());
      own.relative_sd.values[at] = partner.relative_sd.values[k];
      own.confidence.values[at] = confidence;
    }
}

}  // namespace

void borrow_depth(const std::vector<PosedCamera>& cameras,
                  const std::vector<std::vector<std::size_t>>& partners,
                  std::vector<SweptDepth>& swept) {
  std::vector<SweptDepth> filled = swept;
  parallel_for(std::size_t{0}, swept.size(), [&](std::size_t i) {
    for (const std::size_t j : partners[i]) lend(swept[j], cameras[j], cameras[i], filled[i]);
  });
  swept = std::move(filled);
}

}  // namespace organbake
