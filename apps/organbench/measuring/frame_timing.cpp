// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/frame_timing.h"

#include "organbake/player/orbit.h"

#include <cmath>

namespace organbake {
namespace {

constexpr double kDistance = 0.74;

double azimuth(const Eigen::Vector3d& direction) {
  return std::atan2(direction.y(), direction.x());
}
double elevation(const Eigen::Vector3d& direction) { return std::asin(direction.z()); }

}  // namespace

View view_at(const Bundle& bundle, const FrameSize& size, int frame) {
  constexpr double kPerFrame_rad = 0.05;
  return orbit_view(bundle.cameras, {.azimuth_rad = kPerFrame_rad * frame, .distance = kDistance},
                    size.width, size.height);
}

View view_between_three(const Bundle& bundle, const FrameSize& size, int frame) {
  constexpr double kPerFrame_rad = 0.002;
  const ViewManifold& manifold = bundle.cameras.manifold;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::uint32_t camera : manifold.triangles.at(0)) middle += manifold.directions[camera];
  middle.normalize();
  const Eigen::Vector3d& first = manifold.directions.front();
  return orbit_view(bundle.cameras,
                    {.azimuth_rad = azimuth(middle) - azimuth(first) + kPerFrame_rad * frame,
                     .elevation_rad = elevation(middle) - elevation(first),
                     .distance = kDistance},
                    size.width, size.height);
}

double ms_of(const Timing& timing) { return timing.cpu_ms.median / kFrames; }

Timing of_one(Timing timing, std::size_t count) {
  for (Spread* spread : {&timing.wall_ms, &timing.cpu_ms}) {
    for (double* value : {&spread->median, &spread->least, &spread->most}) *value /= double(count);
  }
  return timing;
}

}  // namespace organbake
