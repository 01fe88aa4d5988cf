// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <vector>

#include "organbake/core/random.h"
#include "organbake/motion/clip_tracks.h"
#include "organbake/motion/sightings.h"
#include "unit/motion/bumpy_scene.h"

namespace organbake {

// Features of a bumpy scene as a perfect tracker would follow them, with noise of this many pixels.
struct TrackedScene {
  std::vector<PosedCamera> cameras;
  ClipTracks clip;
};

inline Intrinsics hd_lens() {
  Intrinsics lens;
  lens.width = 1280, lens.height = 720;
  lens.fx = lens.fy = 900;
  lens.cx = 640, lens.cy = 360;
  return lens;
}

// Tracks of features spread over the tissue through these cameras; outliers drift away.
inline TrackedScene tracks_of(std::vector<PosedCamera> cameras, double noise_px = 0.3,
                              double outliers = 0.05) {
  TrackedScene tracked;
  const BumpyScene scene;
  tracked.clip.width = cameras[0].intrinsics.width;
  tracked.clip.height = cameras[0].intrinsics.height;
  tracked.clip.frames = cameras.size();
  tracked.clip.shots = {0};
  RandomStream random(3, 0);
  constexpr int kFeatures = 1500;
  for (int i = 0; i < kFeatures; ++i) {
    const double x = 90 * (random.uniform() - 0.5), y = 60 * (random.uniform() - 0.5);
    const Eigen::Vector3d place(x, y, scene.height_mm(x, y));
    const bool strays = random.uniform() < outliers;
    FeatureTrack track;
    for (std::size_t frame = 0; frame < cameras.size(); ++frame) {
      Eigen::Vector2d pixel = project(cameras[frame], place);
      pixel += noise_px * Eigen::Vector2d(random.normal(), random.normal());
      if (strays) pixel.x() += 4.0 * static_cast<double>(frame);
      const bool inside = pixel.x() > 0 && pixel.y() > 0 && pixel.x() < tracked.clip.width &&
                          pixel.y() < tracked.clip.height;
      if (!inside && track.pixels.empty()) continue;
      if (!inside) break;
      if (track.pixels.empty()) track.first_frame = frame;
      track.pixels.push_back(pixel.cast<float>());
    }
    if (track.pixels.size() >= 2) tracked.clip.tracks.push_back(std::move(track));
  }
  tracked.cameras = std::move(cameras);
  return tracked;
}

// A scope that swings from side to side and comes nearer, looking at the tissue's middle.
inline std::vector<PosedCamera> swinging_scope(int frames, const Intrinsics& lens = hd_lens()) {
  std::vector<PosedCamera> cameras;
  for (int i = 0; i < frames; ++i) {
    const double t = static_cast<double>(i) / (frames - 1);
    const Eigen::Vector3d eye(20 * std::sin(4 * t), 6 * t, 10 * t);
    cameras.push_back({std::to_string(i), lens, look_at(eye, {4 * t, 0, 60}, {0, -1, 0})});
  }
  return cameras;
}

// The scene as its cameras have it; its landmarks have no places yet.
inline Scene posed_scene(const TrackedScene& tracked) {
  Scene scene;
  scene.lens = tracked.cameras[0].intrinsics;
  std::vector<std::size_t> frames;
  for (std::size_t i = 0; i < tracked.cameras.size(); ++i) {
    frames.push_back(i);
    scene.camera_from_world.emplace_back(tracked.cameras[i].camera_from_world);
  }
  scene.landmarks = landmarks_of(tracked.clip, frames);
  return scene;
}

// Root mean square of the camera centres' errors after the similarity that fits them best
// (Umeyama), as a share of the path's extent.
inline double path_error(const std::vector<PosedCamera>& truth,
                         const std::vector<std::optional<RigidTransform>>& found) {
  std::vector<Eigen::Vector3d> a, b;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!found[i]) continue;
    a.push_back(found[i]->inverse().translation);
    b.push_back(truth[i].center_world_mm());
  }
  const auto matrix = [](const std::vector<Eigen::Vector3d>& points) {
    Eigen::Matrix3Xd m(3, points.size());
    for (std::size_t i = 0; i < points.size(); ++i) m.col(static_cast<Eigen::Index>(i)) = points[i];
    return m;
  };
  const Eigen::Matrix3Xd from = matrix(a), to = matrix(b);
  const Eigen::Matrix4d fit = Eigen::umeyama(from, to, true);
  const Eigen::Matrix3Xd moved = (fit * from.colwise().homogeneous()).topRows<3>();
  const Eigen::Vector3d extent = to.rowwise().maxCoeff() - to.rowwise().minCoeff();
  return std::sqrt((moved - to).squaredNorm() / static_cast<double>(a.size())) / extent.norm();
}

}  // namespace organbake
