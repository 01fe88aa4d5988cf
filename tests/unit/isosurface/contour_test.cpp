// SPDX-License-Identifier: GPL-3.0-or-later
// Contours of values of any kind: where they cross, at the border, and slab by slab.

#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/isosurface/isosurface.h"
#include "shape_volumes.h"
#include "support/files.h"
#include "support/testing.h"
#include "surface_steps.h"

namespace organbake {
namespace {

// Noise crosses every kind of edge on every shared slice.
Volume noise() {
  RandomStream random(11);
  Volume volume = grid_around_origin({1, 1, 1}, 20);
  const std::size_t count = static_cast<std::size_t>(volume.size[0]) * volume.size[1] *
                            static_cast<std::size_t>(volume.size[2]);
  for (std::size_t i = 0; i < count; ++i)
    volume.voxels.push_back(static_cast<std::int16_t>(random.below(200)));
  return volume;
}

TEST(SlabContour, IsTheSameSurfaceForAnyThickness) {
  const Volume volume = noise();
  for (const bool cap : {true, false}) {
    const CappedField<std::int16_t> field(volume.voxels, volume.size, value_range(volume), 99.5,
                                          cap);
    const TriangleMesh whole = contour_in_slabs(field, {}, field.size()[2]);
    for (const int slices : {2, 3, 7}) {
      const TriangleMesh mesh = contour_in_slabs(field, {}, slices);
      EXPECT_EQ(mesh.vertices.size(), whole.vertices.size()) << slices;
      EXPECT_EQ(mesh.faces.size(), whole.faces.size()) << slices;
      EXPECT_NEAR(signed_volume(mesh), signed_volume(whole), 1e-3);
      EXPECT_EQ(analyse_topology(mesh).boundary_edges, analyse_topology(whole).boundary_edges);
      if (cap) expect_closed_and_sound(mesh);
    }
  }
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// A ball whose edge is a sigmoid: level L lies at radius 15 + 2 ln(1/L − 1).
double sigmoid(const Eigen::Vector3d& world) { return 1 / (1 + std::exp((world.norm() - 15) / 2)); }
double radius_at(double level) { return 15 + 2 * std::log(1 / level - 1); }

// Of values scale · f + offset, rounded to multiples of `step`.
Volume volume_of(const Shape& f, double scale, double offset, double step = 0) {
  Volume volume = grid_around_origin({1, 1, 1}, 50);
  std::vector<double> values;
  for_each_voxel(volume.size, [&](int i, int j, int k) {
    const double value = scale * f(volume.world_from_index(Eigen::Vector3d(i, j, k))) + offset;
    values.push_back(step > 0 ? step * std::round(value / step) : value);
  });
  set_values(volume, values);
  return volume;
}

TriangleMesh surface_at(const Volume& volume, double level) {
  IsosurfaceOptions options;
  options.iso_hu = level;
  return extract_isosurface(volume, options).mesh;
}

TEST(KindsOfValues, EveryLevelOfAVolumeFromNoughtToOneHasASurfaceOfItsOwn) {
  const Volume volume = volume_of(sigmoid, 1, 0);
  ASSERT_TRUE(volume.is_real());
  for (const double level : {0.2, 0.5, 0.8}) {
    const TriangleMesh mesh = surface_at(volume, level);
    expect_closed_and_sound(mesh);
    constexpr double kSagitta_mm = 0.03;  // of straight lines through the sigmoid and the ball
    EXPECT_LT(radius_rms(mesh, radius_at(level)), kSagitta_mm) << level;
  }
}

// The largest distance between vertices on the same edges of the grid.
double largest_difference(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.vertices.size(), b.vertices.size());
  double largest = 0;
  for (std::size_t v = 0; v < std::min(a.vertices.size(), b.vertices.size()); ++v)
    largest = std::max(largest, (a.vertices[v] - b.vertices[v]).norm());
  return largest;
}

TEST(KindsOfValues, TheSameValuesGiveTheSameSurfaceInAnyUnit) {
  // Whole numbers of 16 bits, the same as float32 by an offset, a share, and beyond 16 bits.
  constexpr double kStep = 1.0 / 255;
  const Volume bytes = volume_of(sigmoid, 255, 0, 1);
  ASSERT_FALSE(bytes.is_real());
  for (const double level : {51.0, 100.3, 204.0}) {
    const TriangleMesh right = surface_at(bytes, level);
    constexpr double kOfAVoxel = 1e-3;
    const auto expect_same = [&](const Volume& volume, double at) {
      EXPECT_TRUE(volume.is_real());
      EXPECT_LT(largest_difference(surface_at(volume, at), right), kOfAVoxel) << at;
    };
    expect_same(volume_of(sigmoid, 1, 0, kStep), level * kStep);
    expect_same(volume_of(sigmoid, 255, 40000, 1), level + 40000);
    expect_same(volume_of(sigmoid, 127.5, 0.5, 0.5), level / 2 + 0.5);
    expect_same(volume_of(sigmoid, 255e6, -1e6, 1e6), level * 1e6 - 1e6);
  }
}

TEST(KindsOfValues, AWholeLevelIsTakenAsItIs) {
  // A slope of 2 a voxel: half a unit would be a quarter of a voxel.
  const Volume volume =
      volume_of([](const Eigen::Vector3d& at) { return 40 - 2 * at.norm(); }, 1, 0, 1);
  constexpr double kRounded_mm = 0.16;  // values are rounded by up to 0.5, 0.29 in the mean
  const TriangleMesh mesh = surface_at(volume, 10);
  EXPECT_LT(radius_rms(mesh, 15), kRounded_mm);
  EXPECT_NEAR(std::cbrt(signed_volume(mesh) / sphere_volume(1)), 15, 0.05);
}

TEST(KindsOfValues, NanIsOutsideAtAnyLevel) {
  // Only what is above 0.6 was measured.
  Volume volume = volume_of(sigmoid, 1, 0);
  std::size_t measured = 0;
  for (float& value : volume.reals) {
    if (value < 0.6f) value = kNan;
    measured += value >= 0.6f;
  }
  for (const double level : {0.1, 0.5, 0.7}) {
    const TriangleMesh mesh = surface_at(volume, level);
    expect_closed_and_sound(mesh);
    const double right = level < 0.6 ? double(measured) : sphere_volume(radius_at(level));
    EXPECT_NEAR(signed_volume(mesh) / right, 1, level < 0.6 ? 0.1 : 0.02) << level;
  }
  // A mask of ones, and nothing else that was measured.
  for (float& value : volume.reals)
    if (!std::isnan(value)) value = 1;
  const TriangleMesh mesh = surface_at(volume, 0.5);
  EXPECT_NEAR(signed_volume(mesh) / double(measured), 1, 0.05);
}

TEST(KindsOfValues, ALevelIsProposedForAnyRange) {
  IsosurfaceOptions options;
  options.iso_hu.reset();
  EXPECT_NEAR(extract_isosurface(volume_of(sigmoid, 1, 0), options).level_hu, 0.5, 0.05);
  EXPECT_NEAR(extract_isosurface(volume_of(sigmoid, 60000, 0), options).level_hu, 30000, 3000);
}

TEST(KindsOfValues, RefiningTakesAnyValues) {
  Volume volume = volume_of(sigmoid, 1, 0);
  IsosurfaceOptions options;
  options.iso_hu = 0.5;
  options.refine = true;
  const TriangleMesh mesh = extract_isosurface(volume, options).mesh;
  EXPECT_LT(radius_rms(mesh, 15), 0.03);
}

TEST(KindsOfValues, LabelsBeyond16BitsAreLabels) {
  const Volume small = mask_of(ball({0, 0, 0}, 12), grid_around_origin({1, 1, 1}, 40), 1);
  Volume wide = small;
  make_real(wide);
  for (float& value : wide.reals) value *= 40000;
  IsosurfaceOptions options;
  const TriangleMesh right = extract_label_surface(small, options).mesh;
  options.label = 40000;
  EXPECT_EQ(largest_difference(extract_label_surface(wide, options).mesh, right), 0);
}

}  // namespace
}  // namespace organbake
