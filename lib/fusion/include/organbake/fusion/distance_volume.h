// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/fusion/depth_view.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A box of voxels along the world's axes.
struct VoxelBox {
  Eigen::Vector3d first_mm = Eigen::Vector3d::Zero();  // centre of the first voxel
  double voxel_mm = 1;
  std::array<int, 3> size = {0, 0, 0};

  std::size_t voxels() const {
    return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]);
  }
  std::size_t index(int x, int y, int z) const {
    return (std::size_t(z) * size[1] + y) * size[0] + x;
  }
};

// How far each voxel lies in front of the surface, as all views have it on average, weighted by
// their confidence (Curless & Levoy 1996): −1…1 in units of the truncation, + outside.
struct DistanceVolume {
  VoxelBox box;
  double truncation_mm = 3;
  std::vector<float> distance;
  std::vector<float> weight;  // 0 = no view has seen the voxel
};

// Round all that the views see but for stray pixels. `voxel_mm` 0: as fine as the views' pixels,
// and so that no more than kMostVoxels are needed. Throws UsageError when the one asked for needs
// more.
inline constexpr std::size_t kMostVoxels = 40'000'000;
VoxelBox box_round(const std::vector<SmoothView>& views, double voxel_mm, double margin_mm);
// Median distance on the surface between the views' pixels, or as many as were averaged.
double usual_pixel_mm(const std::vector<SmoothView>& views);

DistanceVolume fuse_distances(const std::vector<SmoothView>& views, const VoxelBox& box,
                              double truncation_mm, const RunContext& context);

// The surface at distance 0, faces towards the views. Open: none where a voxel around was not
// seen. Closed: what was not seen is inside, and the box's sides close what leaves it.
enum class Holes { open, closed };
TriangleMesh surface_of(const DistanceVolume& volume, Holes holes);

}  // namespace organbake
