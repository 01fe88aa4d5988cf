// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/quantile.h"
#include "organbake/core/random.h"
#include "organbake/motion/feature_tracker.h"
#include "organbake/motion/scene.h"
#include "organbake/shading/prepared_frame.h"
#include "support/testing.h"
#include "view_depths.h"

namespace organbake {

// Tissue as z = height(x, y) in mm, about 60 mm before a scope at the origin, with veins and spots
// of several sizes on it, under a lamp at the lens.
struct BumpyScene {
  double bump_mm = 4;    // of a dome in the middle, 20 mm wide
  double texture = 0.3;  // share of the brightness

  double height_mm(double x, double y) const {
    const double dome = bump_mm * std::exp(-(x * x + y * y) / (2 * 10 * 10));
    return 60 - dome + 1.5 * std::sin(x / 9) * std::cos(y / 7) + 0.08 * x;
  }
  Eigen::Vector3d normal(double x, double y) const {
    constexpr double kStep = 1e-3;
    const double p = (height_mm(x + kStep, y) - height_mm(x - kStep, y)) / (2 * kStep);
    const double q = (height_mm(x, y + kStep) - height_mm(x, y - kStep)) / (2 * kStep);
    return Eigen::Vector3d(p, q, -1).normalized();
  }
  double albedo(double x, double y) const {
    double sum = 0;
    const double turns[] = {0.3, 1.1, 2.0, 2.7, 0.8, 1.6};
    for (int i = 0; i < 6; ++i) {
      const double u = std::cos(turns[i]) * x + std::sin(turns[i]) * y;
      const double v = std::cos(turns[i]) * y - std::sin(turns[i]) * x;
      const double k = 0.7 + 0.35 * i;
      sum += std::sin(k * u + 2 * std::sin(0.3 * v + i)) * std::sin(0.6 * k * v + i);
    }
    return 1 + texture * sum / 3;
  }
};

// What a camera sees: planar depth, and light that a white sheet at 60 mm throws back as 1.
struct BumpyView {
  PosedCamera camera;
  Plane depth_mm, light;
};

inline BumpyView look_at_scene(const BumpyScene& scene, const PosedCamera& camera) {
  const Intrinsics& lens = camera.intrinsics;
  const RigidTransform world = camera.camera_from_world.inverse();
  BumpyView view{camera, Plane(lens.width, lens.height), Plane(lens.width, lens.height)};
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x) {
      const Eigen::Vector3d ray = world.rotation * unproject(lens, {x + 0.5, y + 0.5});
      // Along a ray that is steeper than the surface the crossing draws near by itself.
      double depth = 60;
      double step = 1;
      for (int i = 0; i < 40 && std::abs(step) > 1e-7; ++i) {
        const Eigen::Vector3d at = world.translation + depth * ray;
        step = (scene.height_mm(at.x(), at.y()) - at.z()) / ray.z();
        depth += step;
      }
      const Eigen::Vector3d at = world.translation + depth * ray;
      const Eigen::Vector3d back = world.translation - at;
      const double cosine = std::max(0.0, scene.normal(at.x(), at.y()).dot(back.normalized()));
      view.depth_mm.at(x, y) = static_cast<float>(depth);
      view.light.at(x, y) =
          static_cast<float>(scene.albedo(at.x(), at.y()) * cosine * 3600 / back.squaredNorm());
    }
  return view;
}

// A scope that travels sideways and turns to what it looks at.
inline std::vector<BumpyView> bumpy_clip(const BumpyScene& scene, int frames, int width = 160,
                                         double step_mm = 2) {
  Intrinsics lens;
  lens.width = width, lens.height = width * 3 / 4;
  lens.fx = lens.fy = 0.9 * width;
  lens.cx = 0.5 * lens.width, lens.cy = 0.5 * lens.height;
  std::vector<BumpyView> views;
  for (int i = 0; i < frames; ++i) {
    const double along = (i - 0.5 * (frames - 1)) * step_mm;
    const Eigen::Vector3d eye(along, 0.4 * along * (i % 2 ? 1 : -1), 0.2 * along);
    const RigidTransform pose = look_at(eye, {0.5 * along, 0, 60}, {0, -1, 0});
    views.push_back(look_at_scene(
        scene, {.name = std::to_string(i), .intrinsics = lens, .camera_from_world = pose}));
  }
  return views;
}

// As a camera with a level of noise takes it.
inline PosedFrame frame_of(const BumpyView& view) {
  PosedFrame frame{view.camera, view.light, Mask(view.light.width, view.light.height, 1)};
  RandomStream random(7, static_cast<std::uint64_t>(std::stoi(view.camera.name)));
  for (float& value : frame.intensity.values)
    value = std::round(120 * value + static_cast<float>(random.normal()));
  return frame;
}

inline PreparedFrame prepared_of(const BumpyView& view) {
  PreparedFrame frame;
  const int width = view.light.width, height = view.light.height;
  frame.color = Rgb8Image(width, height);
  frame.camera = view.camera.intrinsics;
  frame.intensity = view.light;
  frame.field = frame.tissue = frame.diffuse = Mask(width, height, 1);
  frame.highlights = frame.instruments = Mask(width, height);
  return frame;
}

// Median of |depth / truth − 1| over what has depth and is wanted (empty = all).
inline double median_error(const Plane& depth, const Plane& truth, const Mask& wanted = {}) {
  std::vector<double> errors;
  for (std::size_t k = 0; k < depth.size(); ++k)
    if (std::isfinite(depth.values[k]) && (wanted.size() == 0 || wanted.values[k]))
      errors.push_back(std::abs(depth.values[k] / truth.values[k] - 1));
  return errors.empty() ? std::numeric_limits<double>::infinity() : median(std::move(errors));
}

inline double known_share(const Plane& depth) {
  const auto known = std::count_if(depth.values.begin(), depth.values.end(),
                                   [](float value) { return std::isfinite(value); });
  return double(known) / double(depth.size());
}

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
                         const std::vector<std::optional<RigidTransform>>& found,
                         Eigen::Matrix4d* truth_from_found = nullptr) {
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
  if (truth_from_found) *truth_from_found = fit;
  const Eigen::Matrix3Xd moved = (fit * from.colwise().homogeneous()).topRows<3>();
  const Eigen::Vector3d extent = to.rowwise().maxCoeff() - to.rowwise().minCoeff();
  return std::sqrt((moved - to).squaredNorm() / static_cast<double>(a.size())) / extent.norm();
}

}  // namespace organbake
