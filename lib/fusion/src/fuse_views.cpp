// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/fusion/fuse_views.h"

#include <algorithm>
#include <cmath>

#include "finer_surface.h"
#include "organbake/core/error.h"
#include "organbake/core/median.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "trimmed_surface.h"

namespace organbake {
namespace {

double usual_noise_mm(const std::vector<SmoothView>& views) {
  std::vector<double> noises;
  for (const SmoothView& view : views) noises.push_back(view.noise_mm);
  return median(std::move(noises));
}

}  // namespace

void FusionOptions::check() const {
  require(voxel_mm == 0 || (voxel_mm >= 0.02 && voxel_mm <= 50), "voxel", voxel_mm,
          "it must be in 0.02…50 mm, or 0 for the depth maps' own");
  require(truncation_mm == 0 || (truncation_mm >= 0.05 && truncation_mm <= 200), "truncation",
          truncation_mm, "it must be in 0.05…200 mm, or 0 for one by the noise");
  require(color_mm == 0 || (color_mm >= 0.02 && color_mm <= 50), "color_mm", color_mm,
          "it must be in 0.02…50 mm, or 0 for the voxels' own");
  require(least_support >= 0 && least_support < 1, "least_support", least_support,
          "it must be in 0…1");
  require(off.place_mm > 0 && off.place_mm <= 50, "place", off.place_mm,
          "it must be above 0 and at most 50 mm");
  require(off.angle_rad > 0 && off.angle_rad <= 0.5, "angle", off.angle_rad,
          "it must be above 0 and at most 0.5 rad");
}

FusedSurface fuse_views(const std::vector<DepthView>& views, const FusionOptions& options,
                        const RunContext& context) {
  options.check();
  if (views.empty()) throw BadDataError("there is no depth map to fuse");
  ScaledViews scaled = scaled_views(views, options.scale);
  std::vector<SmoothView>& smooth = scaled.views;
  check_overlap(measure_overlap(smooth), views);
  context.progress(0.2);
  FusedSurface fused;
  fused.scale = scaled.scale;
  fused.noise_mm = usual_noise_mm(smooth);
  if (options.refine) fused.refined = refine_poses(options.off, smooth);
  fused.apart_mm = fused.refined ? fused.refined->after_mm : views_apart_mm(smooth);
  context.throw_if_cancelled();
  context.progress(0.4);

  // Wide enough for what averaging leaves of the noise; wider would reach the organ's other side.
  constexpr double kVoxels = 4;
  const VoxelBox box = box_round(smooth, options.voxel_mm, options.truncation_mm);
  fused.voxel_mm = box.voxel_mm;
  fused.truncation_mm = options.truncation_mm > 0 ? options.truncation_mm : kVoxels * box.voxel_mm;
  const DistanceVolume volume = fuse_distances(smooth, box, fused.truncation_mm, context);
  context.progress(0.8);
  TriangleMesh surface = surface_of(volume, options.holes);
  if (options.least_support > 0 && options.holes == Holes::open)
    surface = trimmed_surface(largest_components(surface, options.largest), volume,
                              options.least_support);
  fused.mesh = largest_components(surface, options.largest);
  if (fused.mesh.faces.empty())
    throw BadDataError(
        "no surface is left: the depth maps do not overlap, or their poses are far off");
  if (options.color_mm > 0) fused.mesh = finer_surface(fused.mesh, options.color_mm);
  fused.colored_share =
      color_by_views(views, smooth, options.light, 2 * fused.truncation_mm, fused.mesh);
  for (const SmoothView& view : smooth) fused.cameras.push_back(view.camera);
  return fused;
}

}  // namespace organbake
