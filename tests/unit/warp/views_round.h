// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/bundle/bundle.h"
#include "organbake/warp/view.h"
#include "support/testing.h"

namespace organbake {

// Camera 0 turned about the organ's centre: azimuth about world +z, then elevation about its own
// horizontal axis; `away` scales its distance, the focal length follows the picture's height.
inline View view_round(const CameraSet& cameras, double azimuth_rad, double elevation_rad,
                       double away, int width, int height) {
  const PosedCamera& start = cameras.cameras[0];
  const Eigen::Vector3d center = cameras.manifold.center_world_mm;
  const Eigen::Vector3d right = start.camera_from_world.rotation.row(0);
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(azimuth_rad, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(-elevation_rad, right))
                                   .toRotationMatrix();
  View view;
  Intrinsics& k = view.camera.intrinsics;
  k.width = width, k.height = height;
  k.fx = k.fy = start.intrinsics.fy * height / start.intrinsics.height;
  k.cx = 0.5 * width, k.cy = 0.5 * height;
  const Eigen::Vector3d eye = center + away * (turn * (start.center_world_mm() - center));
  view.camera.camera_from_world.rotation = start.camera_from_world.rotation * turn.transpose();
  view.camera.camera_from_world.translation = -(view.camera.camera_from_world.rotation * eye);
  return view;
}

// The organ seen from a direction at the cameras' distance, in a square picture.
inline View view_from(const Bundle& bundle, const Eigen::Vector3d& direction, int size) {
  const PosedCamera& first = bundle.cameras.cameras[0];
  const Eigen::Vector3d center = bundle.cameras.manifold.center_world_mm;
  const double distance = (first.center_world_mm() - center).norm();
  const double focal = first.intrinsics.fx * size / first.intrinsics.width;
  View view;
  view.camera.intrinsics = {size, size, focal, focal, 0.5 * size, 0.5 * size};
  view.camera.camera_from_world =
      look_at(center + distance * direction.normalized(), center, Eigen::Vector3d::UnitZ());
  return view;
}

// Pixels of the background with skin all round.
inline std::size_t holes_in(const Frame& frame) {
  std::size_t holes = 0;
  for (int y = 1; y + 1 < frame.color.height; ++y)
    for (int x = 1; x + 1 < frame.color.width; ++x) {
      int round = 0;
      for (int k = 0; k < 9; ++k) round += frame.covered(x + k % 3 - 1, y + k / 3 - 1);
      holes += round == 8 && !frame.covered(x, y);
    }
  return holes;
}

using Inside = std::function<bool(double x, double y)>;

// White skin on black, one sample a pixel.
inline Frame white_on_black(int width, int height, const Inside& inside) {
  Frame frame;
  frame.color = Rgb8Image(width, height);
  frame.cover.assign(std::size_t(width) * height, Cover::background);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!inside(x + 0.5, y + 0.5)) continue;
      frame.cover[std::size_t(y) * width + x] = Cover::samples;
      std::fill_n(frame.color.at(x, y), 3, std::uint8_t{255});
    }
  }
  return frame;
}

// Calls visit(place, colour) for each of the cameras' texels of the organ, at rest.
template <class Visit>
void each_texel(Bundle& bundle, const Visit& visit) {
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    CameraMaps& maps = bundle.maps[c];
    const PosedCamera& camera = bundle.cameras.cameras[c];
    for (std::size_t i = 0; i < maps.face.size(); ++i) {
      if (maps.face[i] == kNoFace) continue;
      const Eigen::Vector2d pixel(double(i % maps.width) + 0.5, double(i / maps.width) + 0.5);
      visit(camera.camera_from_world.inverse() *
                Eigen::Vector3d(maps.depth_mm[i] * unproject(camera.intrinsics, pixel)),
            maps.color[i]);
    }
  }
}

inline void paint(Bundle& bundle, float albedo) {
  each_texel(bundle, [&](const auto&, Eigen::Vector3f& color) { color.setConstant(albedo); });
  for (Eigen::Vector3f& color : bundle.base.color) color.setConstant(albedo);
}

inline DrawOptions on_black() {
  DrawOptions options;
  options.background = {0, 0, 0};
  return options;
}

}  // namespace organbake
