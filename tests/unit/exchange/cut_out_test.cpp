// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/cut_out.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organ_to_export.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/exchange/bundle_surface.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/image/png.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

class CutOutTest : public testing::Test {
 protected:
  // By formula: whether a place of the picture shows the organ, and how deep.
  double true_depth(std::size_t c, double x, double y) const {
    const PosedCamera& camera = bundle_.cameras.cameras[c];
    return export_options().organ.trace(
        camera.center_world_mm(),
        camera.camera_from_world.rotation.transpose() * unproject(camera.intrinsics, {x, y}));
  }
  CutOut picture(std::size_t c) const {
    return cut_out(bundle_.maps[c], bundle_.cameras.cameras[c], base_, scene_);
  }

  const Bundle& bundle_ = organ_to_export();
  TriangleMesh base_ = base_surface(bundle_);
  RayScene scene_{base_};
};

TEST_F(CutOutTest, TheBaseLayersSurfaceIsTheOrgans) {
  EXPECT_TRUE(analyse_topology(base_).closed_manifold());
  EXPECT_GT(signed_volume(base_), 0);
  constexpr double kStored_mm = 1e-4;  // heights are floats
  for (const Eigen::Vector3d& vertex : base_.vertices)
    ASSERT_LT(off_surface_mm(vertex), kStored_mm);
}

TEST_F(CutOutTest, MasksAreTheOrgansOutline) {
  for (std::size_t c = 0; c < 3; ++c) {
    const CutOut cut = picture(c);
    double both = 0, either = 0;
    for (int y = 0; y < cut.color.height; ++y)
      for (int x = 0; x < cut.color.width; ++x) {
        const bool there = std::isfinite(true_depth(c, x + 0.5, y + 0.5));
        const bool masked = cut.alpha[std::size_t(y) * cut.color.width + x] >= 128;
        both += there && masked;
        either += there || masked;
      }
    EXPECT_GT(both / either, 0.995);
  }
}

TEST_F(CutOutTest, AlphaIsTheShareThatTheOrganCovers) {
  const CutOut cut = picture(1);
  constexpr int kSide = 16;
  double squares = 0;
  int rim = 0;
  for (int y = 0; y < cut.color.height; ++y)
    for (int x = 0; x < cut.color.width; ++x) {
      const double alpha = cut.alpha[std::size_t(y) * cut.color.width + x] / 255.0;
      if (alpha == 0 || alpha == 1) continue;
      int covered = 0;
      for (int r = 0; r < kSide * kSide; ++r)
        covered += std::isfinite(
            true_depth(1, x + (r % kSide + 0.5) / kSide, y + (r / kSide + 0.5) / kSide));
      squares += std::pow(alpha - covered / double(kSide * kSide), 2);
      ++rim;
    }
  ASSERT_GT(rim, 300);
  EXPECT_LT(std::sqrt(squares / rim), 0.05) << "16 rays tell 0.03, the base layer's chords more";
}

TEST_F(CutOutTest, ColoursAndDepthsAreTheMaps) {
  const CutOut cut = picture(0);
  const CameraMaps& maps = bundle_.maps[0];
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    if (maps.face[i] == kNoFace || cut.alpha[i] == 0) continue;
    ASSERT_EQ(cut.depth_mm[i], maps.depth_mm[i]);
    for (int k = 0; k < 3; ++k)
      ASSERT_EQ(cut.color.pixels[3 * i + k], srgb8_from_linear(maps.color[i][k]));
  }
}

TEST(DepthUnit, IsTheFinestRoundOneThatFits) {
  EXPECT_DOUBLE_EQ(depth_unit_mm(655.35), 0.01);
  EXPECT_DOUBLE_EQ(depth_unit_mm(656), 0.02);
  EXPECT_DOUBLE_EQ(depth_unit_mm(2000), 0.05);
  EXPECT_DOUBLE_EQ(depth_unit_mm(3300), 0.1);
}

TEST(DepthPicture, HoldsWholeCountsIn16Bits) {
  CutOut cut;
  cut.color = Rgb8Image(3, 1);
  cut.depth_mm = {0, 123.4f, 655.35f};
  const TemporaryFolder folder;
  const std::string bytes = depth_png(cut, 0.01);
  const StoredPicture read =
      parse_png(std::as_bytes(std::span(bytes.data(), bytes.size())), "depth");
  ASSERT_FALSE(read.linear.empty()) << "16 bits";
  EXPECT_EQ(read.linear[0], 0);
  EXPECT_NEAR(srgb_from_linear(read.linear[3]) * 65535, 12340, 0.5);
  EXPECT_NEAR(srgb_from_linear(read.linear[6]) * 65535, 65535, 0.5);
}

TEST(SurfacePoints, LieOnTheOrganInItsColours) {
  const std::vector<SparsePoint> points = surface_points(organ_to_export(), 1);
  EXPECT_GT(points.size(), 10000u);
  constexpr double kOnSurface_mm = 0.01;  // a depth is a float, seen at up to 80°
  double worst_mm = 0, worst_color = 0;
  for (const SparsePoint& point : points) {
    worst_mm = std::max(worst_mm, off_surface_mm(point.place_mm));
    const Eigen::Vector3f color = export_options().organ.color(point.place_mm);
    for (int k = 0; k < 3; ++k)
      worst_color =
          std::max<double>(worst_color, std::abs(point.srgb[k] - srgb8_from_linear(color[k])));
  }
  EXPECT_LT(worst_mm, kOnSurface_mm);
  EXPECT_LE(worst_color, 1) << "one ray a texel: the texel's colour is the place's own";
}

TEST(SurfacePoints, AreSeenWhereNothingHidesThem) {
  const Bundle& bundle = organ_to_export();
  std::size_t sightings = 0, hidden = 0;
  for (const SparsePoint& point : surface_points(bundle, 4)) {
    EXPECT_GE(point.seen.size(), 1u);
    for (const SparsePoint::Sighting& seen : point.seen) {
      const PosedCamera& camera = bundle.cameras.cameras[seen.image];
      EXPECT_LT((project(camera, point.place_mm) - seen.pixel).norm(), 1e-9);
      const Eigen::Vector3d eye = camera.center_world_mm();
      const double to_skin = export_options().organ.trace(eye, point.place_mm - eye);
      ++sightings;
      hidden += to_skin < 0.98;  // 5 mm of about 250 before it
    }
  }
  EXPECT_GT(sightings, 1000u);
  EXPECT_LT(double(hidden), 0.001 * double(sightings)) << "half a texel at an edge decides";
}

TEST(SurfacePoints, AreNoMoreThanWanted) {
  const std::size_t all = surface_points(organ_to_export(), 2).size();
  const std::size_t few = surface_points(organ_to_export(), 2, 2000).size();
  EXPECT_GT(all, 4000u);
  EXPECT_LE(few, 2000u);
  EXPECT_GT(few, 1000u) << "the grid is coarsened no more than it takes";
}

}  // namespace
}  // namespace organbake
