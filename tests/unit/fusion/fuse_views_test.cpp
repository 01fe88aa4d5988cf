// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/fusion/fuse_views.h"

#include <gmock/gmock.h>

#include <limits>

#include "organ_views.h"
#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/error_message.h"

namespace organbake {
namespace {

using testing::HasSubstr;

// Of the issue: 12 depth maps with 2 % noise.
constexpr double kExactPoses_mm = 0.3, kRefinedPoses_mm = 0.6, kColor_db = 30;
constexpr double kNoise = 0.02, kOff_mm = 1, kOff_rad = 0.017453292519943295;

SurfaceErrors fused_errors(const OrganViews& organ, const FusionOptions& options) {
  return errors_of(fuse_views(organ.views, options).mesh, organ.truth);
}

TEST(FuseViews, TheDefaultsAreValidAndEachBoundIsTold) {
  EXPECT_NO_THROW(FusionOptions{}.check());
  EXPECT_THROW((FusionOptions{.voxel_mm = -1}.check()), UsageError);
  EXPECT_THROW((FusionOptions{.truncation_mm = 1000}.check()), UsageError);
  EXPECT_THROW((FusionOptions{.off = {.place_mm = 0}}.check()), UsageError);
  EXPECT_THROW((FusionOptions{.off = {.angle_rad = 2}}.check()), UsageError);
}

TEST(FuseViews, TwelveNoisyDepthMapsFromExactPoses) {
  const SurfaceErrors errors = fused_errors(organ_views(12, 512, {.noise = kNoise}), {});
  EXPECT_LT(errors.rms_mm, kExactPoses_mm);
  EXPECT_GT(errors.color_db, kColor_db);
}

TEST(FuseViews, TwelveNoisyDepthMapsFromPosesThatAreOff) {
  const OrganViews organ =
      organ_views(12, 512, {.noise = kNoise, .place_mm = kOff_mm, .angle_rad = kOff_rad});
  const SurfaceErrors errors = fused_errors(organ, {.refine = true});
  EXPECT_LT(errors.rms_mm, kRefinedPoses_mm);
  EXPECT_GT(errors.color_db, kColor_db);
}

TEST(FuseViews, HolesStayHolesUnlessTheyAreToBeClosed) {
  OrganViews organ = organ_views(3, 256, {});
  const FusedSurface open = fuse_views(organ.views, {});
  EXPECT_GT(analyse_topology(open.mesh).boundary_edges, 0U);
  const FusedSurface closed = fuse_views(organ.views, {.holes = Holes::closed});
  EXPECT_TRUE(analyse_topology(closed.mesh).closed_manifold());
  EXPECT_GT(signed_volume(closed.mesh), 0);
  // Where there is an open surface the depth maps have it; it lies on the organ.
  EXPECT_LT(errors_of(open.mesh, organ.truth).rms_mm, kExactPoses_mm);
}

TEST(FuseViews, DepthMapsThatCannotBeMeantAreRefused) {
  const OrganViews organ = organ_views(4, 96, {});
  const auto refusal = [&](auto&& change) {
    std::vector<DepthView> views = organ.views;
    change(views[2]);
    return message_of(ExitCode::bad_data, [&] { fuse_views(views, {}); });
  };
  EXPECT_THAT(refusal([](DepthView& view) { view.depth_mm = Plane(48, 48, 100); }),
              HasSubstr("view 2: is 48x48, its camera 96x96"));
  EXPECT_THAT(refusal([](DepthView& view) {
                for (float& z : view.depth_mm.values) z = std::numeric_limits<float>::quiet_NaN();
              }),
              HasSubstr("view 2: holds no depth"));
  EXPECT_THAT(refusal([](DepthView& view) {
                for (float& z : view.depth_mm.values) z *= 0.001F;
              }),
              HasSubstr("another unit"));
  EXPECT_THAT(refusal([](DepthView& view) {
                for (float& z : view.depth_mm.values) z *= 1.3F;
              }),
              HasSubstr("view 2"));
  EXPECT_THAT(refusal([](DepthView& view) {
                view.camera.camera_from_world.translation += Eigen::Vector3d(900, 0, 0);
              }),
              HasSubstr("sees nothing that another depth map sees"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [] { fuse_views({}, {}); }),
              HasSubstr("no depth map"));
}

TEST(FuseViews, PixelsThatAreNoNumberAreHoles) {
  OrganViews organ = organ_views(4, 128, {});
  for (DepthView& view : organ.views)
    for (int x = 50; x < 60; ++x)
      view.depth_mm.at(x, 64) = x % 2 ? std::numeric_limits<float>::quiet_NaN() : -1.F;
  const FusedSurface fused = fuse_views(organ.views, {});
  for (const Eigen::Vector3d& vertex : fused.mesh.vertices) EXPECT_TRUE(vertex.allFinite());
}

}  // namespace
}  // namespace organbake
