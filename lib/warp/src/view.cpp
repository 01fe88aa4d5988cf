// SPDX-License-Identifier: Apache-2.0
// What a view has to be, and how much each camera counts in it.
#include "organbake/warp/view.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/warp/draw_options.h"

namespace organbake {
void View::check() const {
  const Intrinsics& k = camera.intrinsics;
  if (k.width < 1 || k.height < 1 || k.width > kLargestSide_px || k.height > kLargestSide_px) {
    throw UsageError("view of " + std::to_string(k.width) + " × " + std::to_string(k.height) +
                     " pixels: each side needs 1…16384");
  }
  if (k.has_distortion()) throw UsageError("a view is drawn without lens distortion");
  if (!(k.fx > 0 && k.fy > 0) || !std::isfinite(k.fx + k.fy + k.cx + k.cy)) {
    throw UsageError("view: focal lengths need to be positive, the principal point finite");
  }
  if (!camera.camera_from_world.rotation.allFinite() ||
      !camera.camera_from_world.translation.allFinite()) {
    throw UsageError("view: the pose is not finite");
  }
  if (!(near_mm > 0) || !std::isfinite(near_mm)) {
    throw UsageError("view: the near plane needs a positive distance in mm");
  }
}

bool operator==(const View& a, const View& b) {
  const Intrinsics &i = a.camera.intrinsics, &j = b.camera.intrinsics;
  return i.width == j.width && i.height == j.height && i.fx == j.fx && i.fy == j.fy &&
         i.cx == j.cx && i.cy == j.cy && a.near_mm == b.near_mm &&
         a.camera.camera_from_world.rotation == b.camera.camera_from_world.rotation &&
         a.camera.camera_from_world.translation == b.camera.camera_from_world.translation;
}

ViewWeights trimmed(ViewWeights w) {
  double sum = 0;
  for (double& weight : w.weights) {
    weight = std::max(0.0, (weight - kLeastShare) / (1 - kLeastShare));
    sum += weight;
  }
  for (double& weight : w.weights) weight /= sum;  // the largest is at least a third: sum > 0
  return w;
}

ViewWeights drawn_shares(const ViewManifold& manifold, const View& view) {
  Eigen::Vector3d towards_eye = view.camera.center_world_mm() - manifold.center_world_mm;
  if (!(towards_eye.norm() > 1e-9)) towards_eye = -view.camera.view_direction_world();
  return trimmed(view_weights(manifold, towards_eye));
}

std::vector<std::size_t> used_cameras(const ViewWeights& weights) {
  std::vector<std::size_t> used;
  for (int i = 0; i < 3; ++i) {
    if (weights.weights[i] > 0) used.push_back(weights.cameras[i]);
  }
  return used;
}

std::optional<DrawnLight> drawn_light(std::string_view name) {
  for (std::size_t light = 0; light < kLightNames.size(); ++light)
    if (name == kLightNames[light].name) return static_cast<DrawnLight>(light);
  return std::nullopt;
}

std::string all_lights() {
  std::string names = kLightNames.front().name;
  for (std::size_t light = 1; light < kLightNames.size(); ++light)
    names +=
        (light + 1 < kLightNames.size() ? ", " : " or ") + std::string(kLightNames[light].name);
  return names;
}

}  // namespace organbake
