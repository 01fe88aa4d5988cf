// SPDX-License-Identifier: Apache-2.0
#include "organbake/warp/camera_shares.h"

#include <algorithm>

namespace organbake {

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

}  // namespace organbake
