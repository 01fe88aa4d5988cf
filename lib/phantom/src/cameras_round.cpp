// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <numbers>

#include "organ.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kMargin = 0.03;  // of the frame, free on every side

// A small camera's lens: 36° across; neither square pixels nor a centred axis, as in life, so that
// a swapped or forgotten intrinsic shows.
Intrinsics lens(int size) {
  Intrinsics lens;
  lens.width = lens.height = size;
  lens.fx = 1.540 * size;
  lens.fy = 1.537 * size;
  lens.cx = (0.5 + 0.013) * size;
  lens.cy = (0.5 - 0.009) * size;
  return lens;
}

// The least distance at which a point (camera axes, from the aim) stays inside the frame:
// |f a / (D + z) + c| within the margins, solved for D.
double distance_needed(const Intrinsics& lens, const Vector3d& from_aim) {
  const auto along = [&](double offset, double focal, double center, int size) {
    const double room = offset > 0 ? size * (1 - kMargin) - center : center - size * kMargin;
    return std::abs(offset) * focal / room;
  };
  return std::max(along(from_aim.x(), lens.fx, lens.cx, lens.width),
                  along(from_aim.y(), lens.fy, lens.cy, lens.height)) -
         from_aim.z();
}

// A golden-angle spiral from the front (anterior) to the back.
Vector3d spiral_direction(int index, int count) {
  const double y = -1 + (2.0 * index + 1) / count;
  const double angle = index * std::numbers::pi * (3 - std::sqrt(5.0)) + 0.4;
  const double r = std::sqrt(1 - y * y);
  return {r * std::cos(angle), y, r * std::sin(angle)};
}

}  // namespace

std::vector<PosedCamera> cameras_round(const TriangleMesh& surface, int count, int size) {
  const Vector3d aim = bounds(surface).center();
  std::vector<PosedCamera> cameras;
  for (int i = 0; i < count; ++i) {
    PosedCamera camera;
    camera.name = "photo_" + std::to_string(i);
    camera.intrinsics = lens(size);
    const Vector3d outward = spiral_direction(i, count), up = Vector3d::UnitZ();
    const RigidTransform turned = look_at(aim + outward, aim, up);
    double distance = 0;
    for (const Vector3d& vertex : surface.vertices)
      distance =
          std::max(distance, distance_needed(camera.intrinsics, turned.rotation * (vertex - aim)));
    camera.camera_from_world = look_at(aim + distance * outward, aim, up);
    cameras.push_back(camera);
  }
  return cameras;
}

}  // namespace organbake
