// SPDX-License-Identifier: Apache-2.0
#include "placing/placed_faces.h"

#include "organbake/core/parallel.h"
#include "organbake/geometry/shell_map.h"

namespace organbake {
namespace {

constexpr std::size_t kFaceGrain = 128;  // faces of a piece

ShellColumns columns_of(const ShellMatrix& matrix) {
  ShellColumns columns = ShellColumns::Zero();
  columns.topRows<3>() = matrix.cast<float>();
  return columns;
}

}  // namespace

void PlacedFaces::place(const PosedShell& shell, const View& view, bool continued) {
  const RigidTransform& pose = view.camera.camera_from_world;
  const Intrinsics& k = view.camera.intrinsics;
  Eigen::Matrix3d projection;
  projection << k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1;
  frames_.resize(shell.matrices().size());
  continued_ = continued;
  moved_.resize(frames_.size());
  revisions_.resize(frames_.size());
  const auto place_face = [&](std::size_t f) {
    moved_[f] = revisions_[f] != shell.revisions()[f];
    if (!moved(f)) return;
    revisions_[f] = shell.revisions()[f];
    frames_[f].bent = is_bent(shell.matrices()[f]);
    frames_[f].two_sided = shell.two_sided(f);
    ShellMatrix metric = pose.rotation * shell.matrices()[f];
    metric.col(0) += pose.translation;
    const ShellMatrix pixel = projection * metric;
    frames_[f].metric = columns_of(metric);
    frames_[f].pixel = columns_of(pixel);
  };
  parallel_pieces(std::size_t{0}, frames_.size(), kFaceGrain, [&](std::size_t f, std::size_t last) {
    for (; f < last; ++f) place_face(f);
  });
}

void PlacedFaces::add_moved(std::span<const std::uint8_t> changed) {
  if (!continued_) return;
  for (std::size_t f = 0; f < moved_.size(); ++f) moved_[f] |= changed[f];
}

}  // namespace organbake
