// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "organbake/isosurface/label_surface.h"
#include "shape_volumes.h"

namespace organbake {
namespace {

// Two ellipsoids of the size of a small liver, as analytic truth on a grid of 0.5 mm.
double organ(const Eigen::Vector3d& at) {
  const auto inside = [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& radii) {
    return 1 - (at - centre).cwiseQuotient(radii).norm();
  };
  return std::max(inside({-8, 2, -4}, {30, 22, 18}), inside({14, -10, 8}, {14, 12, 12}));
}

Volume turned(Volume grid, const Eigen::Matrix3d& axes) {
  grid.direction = grid.direction * axes;
  const Eigen::Vector3d last(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1);
  grid.origin_mm = grid.origin_mm - grid.world_from_index(last / 2) + Eigen::Vector3d(0.1, 0, 0.2);
  return grid;
}

struct NamedGrid {
  const char* name;
  Volume grid;
};

std::vector<NamedGrid> six_grids() {
  const Volume scan = grid_around_origin({1.2, 1.2, 2.5}, 100);
  Volume shifted = scan;
  shifted.origin_mm += Eigen::Vector3d(0.5, -0.3, 1.2);
  Eigen::Matrix3d permuted;
  permuted << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return {{"shifted", shifted},
          {"finer", grid_around_origin({0.6, 0.6, 0.8}, 100)},
          {"coarser", grid_around_origin({2, 2, 3}, 100)},
          {"oblique", grid_around_origin({1.2, 1.2, 2.5}, 100, oblique_direction())},
          {"flipped", turned(scan, Eigen::Vector3d(1, -1, -1).asDiagonal())},
          {"permuted", turned(scan, permuted)}};
}

TEST(MaskOnOwnGrid, TheOrganLiesWhereItIsAndHasItsVolume) {
  const Volume truth = mask_of(organ, grid_around_origin({0.4, 0.4, 0.4}, 90));
  const TriangleMesh right = extract_label_surface(truth, {}).mesh;
  const Volume scan = scan_of(organ, grid_around_origin({1.2, 1.2, 2.5}, 100));
  for (const NamedGrid& one : six_grids()) {
    const Volume mask = mask_of(organ, one.grid);
    const Isosurface surface = extract_label_surface(mask, {}, {}, &scan);
    expect_closed_and_sound(surface.mesh);
    EXPECT_LT((centroid(surface.mesh) - centroid(right)).norm(), 0.1) << one.name;
    // The voxels of the coarser grid themselves miss 0.5 % of the organ.
    const double voxels = double(count_labels(mask)[0].voxels) * mask.spacing_mm.prod();
    EXPECT_NEAR(signed_volume(surface.mesh) / voxels, 1, 0.0011) << one.name;
    EXPECT_NEAR(signed_volume(surface.mesh) / signed_volume(right), 1, 0.006) << one.name;
    EXPECT_EQ(surface.cut_area_mm2, 0) << one.name;
  }
}

}  // namespace
}  // namespace organbake
