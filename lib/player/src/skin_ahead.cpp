// SPDX-License-Identifier: Apache-2.0
// Depth of the skin under a pixel, by the crossings of its ray with every face: a pointer asks it
// once for a touch, so that no tree is worth its upkeep.
#include "skin_ahead.h"

#include "line_crossing.h"

namespace organbake {

std::optional<double> skin_depth_mm(const Player& player, const View& view,
                                    const Eigen::Vector2i& pixel) {
  const PosedCamera& camera = view.camera;
  const Eigen::Vector3d eye = camera.center_world_mm();
  const Eigen::Vector2d middle = pixel.cast<double>() + Eigen::Vector2d(0.5, 0.5);
  const Eigen::Vector3d ray =
      camera.camera_from_world.rotation.transpose() * unproject(camera.intrinsics, middle);
  std::optional<double> nearest;
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    const TriangleMesh skin = player.bundle_now(o).shell().posed(player.proxy_positions(o));
    for (const auto& [a, b, c] : skin.faces) {
      const std::optional<double> depth_mm =
          line_crossing(eye, ray, skin.vertices[a], skin.vertices[b], skin.vertices[c]);
      if (depth_mm && *depth_mm > view.near_mm && (!nearest || depth_mm < nearest))
        nearest = depth_mm;
    }
  }
  return nearest;
}

}  // namespace organbake
