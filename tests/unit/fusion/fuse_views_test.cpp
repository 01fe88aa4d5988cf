// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/fusion/fuse_views.h"

#include "organ_views.h"
#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/refine.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

using testing::HasSubstr;

// Of the issue: 12 depth maps with 2 % noise.
constexpr double kExactPoses_mm = 0.3, kRefinedPoses_mm = 0.6, kColor_db = 30;
constexpr double kNoise = 0.02, kOff_mm = 1, kOff_rad = 0.017453292519943295;

SurfaceErrors fused_errors(const OrganViews& organ, const FusionOptions& options) {
  return errors_of(fuse_views(organ.views, options).mesh, organ.truth);
}

TEST(FuseViews, VoxelsMustHaveAPossibleSize) {
  EXPECT_NO_THROW(FusionOptions{}.check());
  EXPECT_THROW((FusionOptions{.voxel_mm = -1}.check()), UsageError);
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

double farthest_from_sphere_mm(const TriangleMesh& mesh, double radius_mm) {
  double farthest = 0;
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    farthest = std::max(farthest, std::abs(vertex.norm() - radius_mm));
  return farthest;
}

TEST(FinerSurface, IsAsFineAsAskedAndRounderThanItsFaces) {
  constexpr double kRadius_mm = 20;
  TriangleMesh coarse = make_icosphere(2);
  for (Eigen::Vector3d& vertex : coarse.vertices) vertex *= kRadius_mm;
  const TriangleMesh fine = finer_surface(coarse, 1.5);
  for (const Face& face : fine.faces)
    for (int i = 0; i < 3; ++i)
      EXPECT_LT((fine.vertices[face[i]] - fine.vertices[face[(i + 1) % 3]]).norm(), 2);
  // The middle of a face with edges of 6.3 mm lies 0.34 mm below the sphere, an edge's 0.25.
  EXPECT_LT(farthest_from_sphere_mm(fine, kRadius_mm), 0.35);
  EXPECT_GT(signed_volume(fine), signed_volume(coarse)) << "rounder, not smaller";
  EXPECT_TRUE(analyse_topology(fine).closed_manifold());
}

TEST(FinerSurface, KeepsBordersWhereTheyAre) {
  TriangleMesh square;
  square.vertices = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}};
  square.faces = {{0, 1, 2}, {0, 2, 3}};
  const TriangleMesh fine = finer_surface(square, 1);
  EXPECT_NEAR(surface_area(fine), 100, 1e-9);
}

constexpr int kSide = 41;  // vertices, and voxels, 1 mm apart

// A sheet of squares where `covered`, in a volume whose weights are as `weight` has them.
struct Sheet {
  TriangleMesh mesh;
  DistanceVolume volume;

  Sheet(const std::function<bool(int, int)>& covered,
        const std::function<float(int, int)>& weight) {
    volume.box = {Eigen::Vector3d::Zero(), 1, {kSide, kSide, 1}};
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        mesh.vertices.emplace_back(x, y, 0);
        volume.weight.push_back(weight(x, y));
      }
    const auto at = [](int x, int y) { return static_cast<std::uint32_t>(y * kSide + x); };
    for (int y = 0; y + 1 < kSide; ++y)
      for (int x = 0; x + 1 < kSide; ++x)
        if (covered(x, y)) {
          mesh.faces.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
          mesh.faces.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
        }
  }
};

double border_length(const TriangleMesh& mesh) {
  double length = 0;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 1)
      length += (mesh.vertices[uses[0].low] - mesh.vertices[uses[0].high]).norm();
  });
  return length;
}

TEST(TrimmedSurface, CutsOffWhatIsPoorlySeen) {
  const Sheet sheet([](int, int) { return true; }, [](int x, int) { return x < 30 ? 1.F : 0.02F; });
  const TriangleMesh trimmed = trimmed_surface(sheet.mesh, sheet.volume, 0.25);
  // Weights are spread by a few voxels.
  EXPECT_NEAR(surface_area(trimmed), 30 * 40, 3.5 * 40);
  for (const Face& face : trimmed.faces)
    for (const std::uint32_t corner : face) EXPECT_LT(trimmed.vertices[corner].x(), 34);
}

TEST(TrimmedSurface, LeavesWhatIsPoorlySeenInside) {
  const Sheet sheet([](int, int) { return true; },
                    [](int x, int y) { return std::hypot(x - 20, y - 20) < 5 ? 0.02F : 1.F; });
  const TriangleMesh trimmed = trimmed_surface(sheet.mesh, sheet.volume, 0.25);
  EXPECT_EQ(analyse_topology(largest_components(trimmed, 1)).euler_characteristic, 1);
}

TEST(TrimmedSurface, RoundsTheStepsOfABorder) {
  const auto disc = [](int x, int y) { return std::hypot(x - 19.5, y - 19.5) < 15; };
  const Sheet sheet(disc, [](int, int) { return 1.F; });
  const TriangleMesh trimmed = trimmed_surface(sheet.mesh, sheet.volume, 0.25);
  // Steps make a circle's border 4/π times as long; what hangs on by a corner goes, too.
  EXPECT_GT(border_length(sheet.mesh), 1.2 * 2 * M_PI * 15);
  EXPECT_LT(border_length(trimmed), 1.06 * 2 * M_PI * 15);
  EXPECT_GT(surface_area(trimmed), 0.93 * M_PI * 15 * 15);
}

}  // namespace

// Depths and poses of unlike units: the organ must come out where and as large as it is.
namespace {

constexpr double kScale = 0.005;    // of the scale that is found
constexpr double kWorseEach = 1.5;  // a map's own scale is told by what it shares alone
constexpr double kWorse = 1.2;      // than with poses and depths in one unit
constexpr double kUnit_mm = 7.3;    // of poses as COLMAP has them

OrganViews organ() { return organ_views(10, 192, {.noise = 0.01}); }

double error_mm(const FusedSurface& fused, const OrganViews& organ) {
  return errors_of(fused.mesh, organ.truth).rms_mm;
}

double usual_error_mm() {
  static const double usual = [] {
    const OrganViews organ_mm = organ();
    return error_mm(fuse_views(organ_mm.views, {.scale = DepthScale::given}), organ_mm);
  }();
  return usual;
}

void scale_places(double factor, OrganViews& organ) {
  for (DepthView& view : organ.views) view.camera.camera_from_world.translation *= factor;
}

void make_relative(double factor, DepthView& view) {
  for (float& z : view.depth_mm.values) z *= static_cast<float>(factor);
  view.relative = true;
}

TEST(SolveScale, PosesAndDepthsOfOneUnitStayAsTheyAre) {
  const OrganViews organ_mm = organ();
  const FusedSurface fused = fuse_views(organ_mm.views, {});
  EXPECT_FALSE(fused.scale);
  EXPECT_LT(error_mm(fused, organ_mm), kWorse * usual_error_mm());
}

TEST(SolveScale, MetricDepthsBringTheirUnitToThePoses) {
  for (const double unit_mm : {kUnit_mm, 1 / kUnit_mm}) {
    OrganViews organ_mm = organ();
    scale_places(1 / unit_mm, organ_mm);
    const FusedSurface fused = fuse_views(organ_mm.views, {});
    ASSERT_TRUE(fused.scale) << unit_mm;
    EXPECT_NEAR(fused.scale->solved.place_factor / unit_mm, 1, kScale);
    EXPECT_LT(error_mm(fused, organ_mm), kWorse * usual_error_mm());
  }
}

TEST(SolveScale, RelativeDepthsTakeTheUnitOfThePoses) {
  OrganViews organ_mm = organ();
  for (DepthView& view : organ_mm.views) make_relative(1 / 80.0, view);
  const FusedSurface fused = fuse_views(organ_mm.views, {});
  ASSERT_TRUE(fused.scale);
  EXPECT_EQ(fused.scale->how, DepthScale::one);
  EXPECT_TRUE(fused.scale->in_poses_unit);
  EXPECT_LT(error_mm(fused, organ_mm), kWorse * usual_error_mm());
}

// As `shade` writes them without a range: every map's median is 1.
TEST(SolveScale, EachMapMayHaveAUnitOfItsOwn) {
  OrganViews organ_mm = organ();
  for (std::size_t i = 0; i < organ_mm.views.size(); ++i)
    make_relative((i % 3 + 1) / 120.0, organ_mm.views[i]);
  const FusedSurface fused = fuse_views(organ_mm.views, {});
  ASSERT_TRUE(fused.scale);
  EXPECT_EQ(fused.scale->how, DepthScale::each);
  EXPECT_NEAR(fused.scale->solved.depth_factor[0] / fused.scale->solved.depth_factor[2], 3,
              3 * kScale);
  EXPECT_LT(error_mm(fused, organ_mm), kWorseEach * usual_error_mm());
}

TEST(SolveScale, UnitsThatCannotBeMeantAreRefused) {
  OrganViews organ_mm = organ();
  make_relative(0.001, organ_mm.views[1]);
  const auto refusal = [&](DepthScale scale) {
    return message_of(ExitCode::bad_data, [&] { fuse_views(organ_mm.views, {.scale = scale}); });
  };
  EXPECT_THAT(refusal(DepthScale::automatic), HasSubstr("view 1: is relative, others"));
  for (DepthView& view : organ_mm.views) view.relative = true;
  EXPECT_THAT(refusal(DepthScale::given), HasSubstr("another unit"));
}

std::vector<SmoothView> smooth(const OrganViews& organ) {
  std::vector<SmoothView> views;
  for (const DepthView& view : organ.views) views.push_back(smooth_view(view));
  return views;
}

TEST(RefinePoses, ViewsThatAreOffComeTogether) {
  std::vector<SmoothView> views = smooth(organ_views(8, 192, {.place_mm = 1, .angle_rad = 0.017}));
  const RefinedPoses refined = refine_poses(views);
  // What remains is the depth maps' own coarseness, not the poses.
  constexpr double kTogether = 0.15;
  EXPECT_LT(refined.after_mm, kTogether * refined.before_mm);
  EXPECT_GT(refined.moved_mm, 0.3);
}

TEST(RefinePoses, ExactViewsStayWhereTheyAre) {
  std::vector<SmoothView> views = smooth(organ_views(8, 192, {}));
  const RefinedPoses refined = refine_poses(views);
  constexpr double kStill_mm = 0.1, kStill_rad = 0.001;
  EXPECT_LT(refined.moved_mm, kStill_mm);
  EXPECT_LT(refined.turned_rad, kStill_rad);
}

TEST(RefinePoses, OneViewHasNothingToGoBy) {
  std::vector<SmoothView> views = smooth(organ_views(1, 64, {}));
  EXPECT_EQ(refine_poses(views).rounds, 0);
}

}  // namespace
}  // namespace organbake
