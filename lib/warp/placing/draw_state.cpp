// SPDX-License-Identifier: Apache-2.0
#include "warp/placing/draw_state.h"

#include "geometry/shell_map.h"

namespace organbake {
namespace {

ShellColumns columns_of(const ShellMatrix& matrix) {
  ShellColumns columns = ShellColumns::Zero();
  columns.topRows<3>() = matrix.cast<float>();
  return columns;
}

}  // namespace

void face_frames(const PosedShell& shell, const View& view, std::vector<FaceFrame>& frames) {
  const RigidTransform& pose = view.camera.camera_from_world;
  const Intrinsics& k = view.camera.intrinsics;
  Eigen::Matrix3d projection;
  projection << k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1;
  frames.resize(shell.matrices().size());
  for (std::size_t f = 0; f < frames.size(); ++f) {
    frames[f].bent = is_bent(shell.matrices()[f]);
    frames[f].two_sided = shell.two_sided(f);
    ShellMatrix metric = pose.rotation * shell.matrices()[f];
    metric.col(0) += pose.translation;
    const ShellMatrix pixel = projection * metric;
    frames[f].metric = columns_of(metric);
    frames[f].pixel = columns_of(pixel);
  }
}

}  // namespace organbake
