// SPDX-License-Identifier: GPL-3.0-or-later
#include "frame_poses.h"

#include <algorithm>

#include "organbake/core/parallel.h"
#include "organbake/motion/bundle_adjustment.h"

namespace organbake {
namespace {

constexpr std::size_t kEnoughFeatures = 300;  // features hold a pose as well as thousands
constexpr std::size_t kFewestFeatures = 15;
constexpr double kFitsFrame_px = 4;

struct FeaturePlaces {
  std::vector<Eigen::Vector3d> places;
  std::vector<Eigen::Vector2d> pixels;
};

FeaturePlaces seen_in(const ClipTracks& clip, const Scene& scene, std::size_t frame) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i)
    if (scene.landmarks[i].place && clip.tracks[scene.landmarks[i].track].is_in(frame))
      all.push_back(i);
  const std::size_t step = std::max<std::size_t>(1, all.size() / kEnoughFeatures);
  FeaturePlaces seen;
  for (std::size_t i = 0; i < all.size(); i += step) {
    const Landmark& landmark = scene.landmarks[all[i]];
    seen.places.push_back(*landmark.place);
    seen.pixels.push_back(clip.tracks[landmark.track].at(frame).cast<double>());
  }
  return seen;
}

}  // namespace

std::vector<std::optional<RigidTransform>> pose_frames(const ClipTracks& clip,
                                                       const std::vector<std::size_t>& view_frames,
                                                       const Scene& scene) {
  std::vector<std::optional<RigidTransform>> poses(clip.frames);
  std::vector<std::size_t> posed;
  for (std::size_t view = 0; view < view_frames.size(); ++view)
    if (scene.is_posed(view)) posed.push_back(view);
  if (posed.empty()) return poses;
  // Features reach some frames beyond the outermost views.
  constexpr std::size_t kBeyond = 10;
  const std::size_t first = view_frames[posed.front()], last = view_frames[posed.back()];
  const std::size_t begin = first - std::min(first, kBeyond);
  parallel_for(begin, std::min(clip.frames, last + 1 + kBeyond), [&](std::size_t frame) {
    const auto distance = [&](std::size_t view) {
      return view_frames[view] > frame ? view_frames[view] - frame : frame - view_frames[view];
    };
    const std::size_t nearest =
        *std::min_element(posed.begin(), posed.end(),
                          [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
    RigidTransform pose = *scene.camera_from_world[nearest];
    if (view_frames[nearest] != frame) {
      const FeaturePlaces seen = seen_in(clip, scene, frame);
      const std::size_t agreeing =
          adjust_pose(scene.lens, seen.places, seen.pixels, kFitsFrame_px, pose);
      if (agreeing < kFewestFeatures || 2 * agreeing < seen.places.size()) return;
    }
    poses[frame] = pose;
  });
  return poses;
}

}  // namespace organbake
