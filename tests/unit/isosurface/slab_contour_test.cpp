// SPDX-License-Identifier: GPL-3.0-or-later
#include "slab_contour.h"

#include <gtest/gtest.h>

#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "shape_volumes.h"

namespace organbake {
namespace {

// Noise crosses every kind of edge on every shared slice.
Volume noise() {
  RandomStream random(11);
  Volume volume = grid_around_origin({1, 1, 1}, 20);
  const std::size_t count = static_cast<std::size_t>(volume.size[0]) * volume.size[1] *
                            static_cast<std::size_t>(volume.size[2]);
  for (std::size_t i = 0; i < count; ++i) {
    volume.voxels.push_back(static_cast<std::int16_t>(random.below(200)));
  }
  return volume;
}

TEST(SlabContour, IsTheSameSurfaceForAnyThickness) {
  const Volume volume = noise();
  for (const bool cap : {true, false}) {
    const CappedField<std::int16_t> field(volume.voxels, volume.size, value_range(volume), 99.5,
                                          cap);
    const TriangleMesh whole =
        contour_in_slabs(field, IsosurfaceMethod::flying_edges, {}, field.size()[2]);
    for (const int slices : {2, 3, 7}) {
      const TriangleMesh mesh = contour_in_slabs(field, IsosurfaceMethod::flying_edges, {}, slices);
      EXPECT_EQ(mesh.vertices.size(), whole.vertices.size()) << slices;
      EXPECT_EQ(mesh.faces.size(), whole.faces.size()) << slices;
      EXPECT_NEAR(signed_volume(mesh), signed_volume(whole), 1e-3);
      EXPECT_EQ(analyse_topology(mesh).boundary_edges, analyse_topology(whole).boundary_edges);
      if (cap) expect_closed_and_sound(mesh);
    }
  }
}

TEST(SlabContour, MarchingCubesGivesTheSameSurface) {
  const Volume ct = scan_of(asymmetric_organ(), grid_around_origin({1, 1.2, 0.9}, 60));
  const CappedField<std::int16_t> field(ct.voxels, ct.size, value_range(ct), -450.5, true);
  const auto surface = [&](IsosurfaceMethod method) {
    return contour_in_slabs(field, method, {}, 9);
  };
  const TriangleMesh fast = surface(IsosurfaceMethod::flying_edges);
  const TriangleMesh slow = surface(IsosurfaceMethod::marching_cubes);
  expect_closed_and_sound(slow);
  EXPECT_EQ(slow.vertices.size(), fast.vertices.size());
  EXPECT_EQ(slow.faces.size(), fast.faces.size());
  constexpr double kTriangulation = 1e-3;  // the two cut some cubes' polygons differently
  EXPECT_NEAR(signed_volume(slow) / signed_volume(fast), 1, kTriangulation);
}

}  // namespace
}  // namespace organbake
