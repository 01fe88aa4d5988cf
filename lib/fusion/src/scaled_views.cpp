// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/fusion/scaled_views.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/median.h"
#include "organbake/core/parallel.h"
#include "organbake/fusion/fuse_views.h"

namespace organbake {
namespace {

// Poses whose unit differs by less are off, not in another unit; and by another one the views must
// agree far better.
constexpr double kOtherUnit = 1.15, kFarBetter = 0.5;
bool are_relative(const std::vector<DepthView>& views) {
  const auto count = std::count_if(views.begin(), views.end(),
                                   [](const DepthView& view) { return view.relative; });
  if (count == 0 || static_cast<std::size_t>(count) == views.size()) return count > 0;
  const auto relative =
      std::find_if(views.begin(), views.end(), [](const DepthView& view) { return view.relative; });
  throw BadDataError(relative->name,
                     "is relative, others of the depth maps are in millimetres; fuse them apart");
}

// 0 without any depth, which smooth_view() tells.
double usual_depth(const DepthView& view) {
  std::vector<float> depths;
  for (const float z : view.depth_mm.values)
    if (std::isfinite(z) && z > 0) depths.push_back(z);
  return double(median(std::move(depths)));
}

// All depths by one factor so that the usual one is kAssumedDepth_mm.
std::vector<SmoothView> smooth_views(const std::vector<DepthView>& views, bool normalised) {
  double factor = 1;
  if (normalised) {
    std::vector<double> usual;
    for (const DepthView& view : views)
      if (const double depth = usual_depth(view); depth > 0) usual.push_back(depth);
    if (!usual.empty()) factor = kAssumedDepth_mm / median(std::move(usual));
  }
  std::vector<SmoothView> smooth(views.size());
  parallel_for(std::size_t{0}, views.size(), [&](std::size_t i) {
    if (factor == 1) {
      smooth[i] = smooth_view(views[i]);
      return;
    }
    DepthView scaled = views[i];
    for (float& z : scaled.depth_mm.values) z *= static_cast<float>(factor);
    smooth[i] = smooth_view(scaled);
  });
  return smooth;
}

void rescale(const FusedScale& scale, std::vector<SmoothView>& views) {
  const double places = scale.solved.place_factor;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double own = scale.solved.depth_factor[i];
    if (own != 1) scale_depth(own, views[i]);
    if (scale.in_poses_unit) {
      scale_depth(1 / places, views[i]);
    } else {
      scale_place(places, views[i]);
    }
  }
}

// Whether each map is of the scale of the others, with the places so many times as far apart.
bool agree(std::vector<SmoothView>& views, double place_factor) {
  std::vector<RigidTransform> given;
  for (SmoothView& view : views) {
    given.push_back(view.camera.camera_from_world);
    scale_place(place_factor, view);
  }
  const std::vector<ViewOverlap> overlaps = measure_overlap(views);
  for (std::size_t i = 0; i < views.size(); ++i) views[i].camera.camera_from_world = given[i];
  return std::all_of(overlaps.begin(), overlaps.end(), [](const ViewOverlap& overlap) {
    return !sees_nothing_in_common(overlap) && !is_of_another_scale(overlap);
  });
}

std::optional<FusedScale> scale_of(std::vector<SmoothView>& views, DepthScale wanted,
                                   bool relative) {
  if (wanted == DepthScale::given || views.size() < 2) return std::nullopt;
  FusedScale scale{.how = wanted == DepthScale::each ? DepthScale::each : DepthScale::one,
                   .relative = relative};
  scale.solved = solve_scale(views, scale.how == DepthScale::each);
  const SolvedScale& solved = scale.solved;
  if (wanted == DepthScale::automatic && !relative) {
    const bool other = std::abs(std::log(solved.place_factor)) > std::log(kOtherUnit);
    if (!other || !solved.told() || solved.apart > kFarBetter * solved.apart_as_given)
      return std::nullopt;
  }
  // Each of `shade`'s relative maps has a unit of its own.
  if (wanted == DepthScale::automatic && relative && !agree(views, solved.place_factor)) {
    scale.how = DepthScale::each;
    scale.solved = solve_scale(views, true);
  }
  const double in_poses_unit = kAssumedDepth_mm / scale.solved.place_factor;
  scale.in_poses_unit = relative && scale.solved.told() && in_poses_unit >= kNearestDepth_mm &&
                        in_poses_unit <= kFarthestDepth_mm;
  return scale;
}

}  // namespace

ScaledViews scaled_views(const std::vector<DepthView>& views, DepthScale scale) {
  const bool relative = are_relative(views) && scale != DepthScale::given;
  ScaledViews result;
  result.views = smooth_views(views, relative);
  result.scale = scale_of(result.views, scale, relative);
  if (result.scale) rescale(*result.scale, result.views);
  return result;
}

}  // namespace organbake
