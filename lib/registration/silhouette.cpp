// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/silhouette.h"

#include <algorithm>

#include "image/srgb.h"
#include "registration/color_model.h"
#include "registration/global_search.h"

namespace organbake {
namespace {

// How much of each pixel the organ fills at a pose; −1 far from it, where other things may have its
// colour. A second picture of the lens does for all poses.
std::vector<float> inside_of(const RegisteredSurface& surface, const PhotoLevel& level,
                             const ObjectPose& pose) {
  constexpr double kAround = 1.0;  // of the organ's radius: ground that it is told from
  std::vector<float> inside(level.valid.size(), -1);
  const ShadingBasis basis({LightModel::flat}, pose.center_camera_mm.norm());
  const int margin = static_cast<int>(kAround * level.intrinsics.fx * surface.radius_mm() /
                                      std::max(1e-9, pose.center_camera_mm.z()));
  Prediction p;
  predict(surface, level, pose, 1, basis, basis.first_weights(),
          {.smooth_outlines = false, .margin = std::clamp(margin, 4, level.intrinsics.width)}, p);
  for (int y = p.top; y < p.top + p.height; ++y)
    for (int x = p.left; x < p.left + p.width; ++x)
      if (level.valid[level.index(x, y)]) inside[level.index(x, y)] = p.coverage[p.index(x, y)];
  return inside;
}

// 8-bit, so that it makes a pyramid as any photograph.
Rgb8Image picture_of(const std::vector<float>& probability, int width, int height) {
  Rgb8Image picture(width, height);
  for (std::size_t i = 0; i < probability.size(); ++i)
    std::fill_n(&picture.pixels[3 * i], 3, srgb8_from_linear(0.1f + 0.8f * probability[i]));
  return picture;
}

}  // namespace

ColorSilhouette refine_silhouette(const RegisteredSurface& surface, const PhotoToRegister& photo,
                                  const RigidTransform& start, int finest_side_px,
                                  const RefineOptions& options, const RunContext& context) {
  constexpr int kRounds = 5;
  constexpr int kCoarsestSide = 96;  // pixels
  PhotoLevel whole;                  // of the photograph, for what lies inside
  whole.intrinsics = photo.intrinsics;
  whole.valid = valid_pixels(photo.image, photo.mask);
  whole.rays = pixel_rays(photo.intrinsics);
  ColorSilhouette result;
  ObjectPose pose = object_pose(start, surface.center());
  for (int round = 0; round < kRounds; ++round) {
    context.throw_if_cancelled();
    const Rgb8Image likely =
        picture_of(foreground_probability(photo.image, inside_of(surface, whole, pose)),
                   photo.image.width, photo.image.height);
    result.pyramid =
        photo_pyramid(likely, photo.mask, photo.intrinsics, finest_side_px, kCoarsestSide);
    if (result.pyramid.empty()) return result;
    const int coarsest = static_cast<int>(result.pyramid.size()) - 1;
    // The wide search while the colours are rough, then what they say in detail.
    if (round < 2) {
      result.state = search_near(surface, result.pyramid, rigid_transform(pose, surface.center()),
                                 options, context)
                         .best;
    } else {
      result.state = {};
      result.state.solver.pose = pose.to_array();
    }
    const int last = std::max(0, std::min(coarsest, kRounds - 2 - round));
    if (round < 2 && !result.state.usable) return result;
    refine(surface, result.pyramid, coarsest, last, options, result.state, context);
    if (!result.state.usable) return result;
    pose = result.state.solver.object_pose();
  }
  return result;
}

}  // namespace organbake
