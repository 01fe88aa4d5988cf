// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/viewpoints/placement.h"

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "placing.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

// Of 16,384 samples: the reported coverage against that of the choice, both of the same surface.
constexpr double kSampling = 2e-3;

PlacementOptions covering(double share = 0.99, int overlap = 2) {
  PlacementOptions options;
  options.coverage =
      CoverageGoal{.share = share, .overlap = overlap, .candidates = 300, .samples = 1500};
  return options;
}

TEST(CoverageGoal, BoundsAreChecked) {
  EXPECT_NO_THROW(covering().check());
  const auto refused = [](auto change) {
    PlacementOptions options = covering();
    change(*options.coverage);
    EXPECT_THROW(options.check(), UsageError);
  };
  refused([](auto& g) { g.share = 0.4; });
  refused([](auto& g) { g.share = std::numeric_limits<double>::quiet_NaN(); });
  refused([](auto& g) { g.overlap = 0; });
  refused([](auto& g) { g.overlap = 5; });
  refused([](auto& g) { g.texel_mm = -1; });
  refused([](auto& g) { g.candidates = 15; });
  refused([](auto& g) { g.samples = 63; });
}

TEST(CoverCameras, ReachTheGoalWithFewerThanEvenOnes) {
  const TriangleMesh lump = lumpy_mesh(50, 4);
  const Placement placement = place_cameras(lump, covering());
  ASSERT_TRUE(placement.cover);
  EXPECT_TRUE(placement.cover->reached);
  EXPECT_LE(placement.cover->for_coverage, placement.cameras.size());
  const CoverageReport report = measure_coverage(lump, placement, covering());
  EXPECT_NEAR(report.reachable_share, 1, 1e-3);
  EXPECT_GE(report.seen_share[1], 0.99 - kSampling);
  EXPECT_LE(report.at_rest.mean_gap, 1e-3);
  PlacementOptions even;
  even.count = static_cast<int>(placement.cameras.size());
  EXPECT_LT(measure_coverage(lump, place_cameras(lump, even), even).seen_share[1], 0.99);
}

TEST(CoverCameras, AreTheSameForAnyNumberOfThreads) {
  const TriangleMesh lump = lumpy_mesh(50, 3);
  const auto eyes = [&] {
    std::vector<Eigen::Vector3d> eyes;
    for (const auto& camera : place_cameras(lump, covering()).cameras) {
      eyes.push_back(camera.center_world_mm());
    }
    return eyes;
  };
  const auto many = eyes();
  const ThreadLimit one(1);
  EXPECT_EQ(many, eyes());
}

TEST(CoverCameras, AMirroredOrganIsServedAsWell) {
  TriangleMesh mirrored = lumpy_mesh(50, 4);
  for (Eigen::Vector3d& vertex : mirrored.vertices) vertex.x() = -vertex.x();
  const auto count = [](const TriangleMesh& mesh) {
    const Placement placement = place_cameras(mesh, covering());
    EXPECT_TRUE(placement.cover->reached);
    return static_cast<double>(placement.cameras.size());
  };
  EXPECT_NEAR(count(inside_out(mirrored)), count(lumpy_mesh(50, 4)), 1);
}

TEST(CoverCameras, StandInTheRegionOrALittleBesideIt) {
  for (const double half_angle : {0.4, std::numbers::pi / 2}) {
    PlacementOptions options = covering();
    options.cone = ViewingCone{{0.2, -1, 0.1}, half_angle};
    const TriangleMesh lump = lumpy_mesh(50, 4);
    const Placement placement = place_cameras(lump, options);
    for (const Eigen::Vector3d& d : placement.manifold.directions) {
      const double off_axis = std::acos(d.dot(options.cone->axis.normalized()));
      EXPECT_LE(off_axis, half_angle + kBeyondRegion_rad + 1e-6);
    }
    const CoverageReport report = measure_coverage(lump, placement, options);
    // The far side is out of the region's sight, and is not asked for.
    EXPECT_LT(report.reachable_share, half_angle < 1 ? 0.6 : 0.999);
    EXPECT_GT(report.hidden_share, 0.01);
    if (placement.cover->reached) {
      EXPECT_GE(report.seen_share[1], 0.99 - 3 * kSampling);
    }
  }
}

// Half of the organ is not shown: who looks at the rest is not to pay for a ring of cameras round
// it.
TEST(CoverCameras, ViewersInAConeNeedFewerOfThem) {
  const TriangleMesh lump = lumpy_mesh(50, 4);
  const std::size_t all_round = place_cameras(lump, covering()).cameras.size();
  PlacementOptions options = covering();
  options.cone = ViewingCone{{0.2, -1, 0.1}, std::numbers::pi / 6};
  const Placement placement = place_cameras(lump, options);
  EXPECT_LE(10 * placement.cameras.size(), 6 * all_round);
  // The deepest dents show themselves from directions that lie between so few candidates.
  EXPECT_GE(measure_coverage(lump, placement, options).seen_share[1], 0.98);
}

TEST(CoverCameras, SayWhenTheGoalIsOutOfReach) {
  std::string warning;
  const RunContext context(
      [&](LogLevel level, std::string_view message) {
        if (level == LogLevel::warning) warning += message;
      },
      {}, nullptr);
  PlacementOptions options = covering(1, 4);
  options.coverage->candidates = 16;
  const Placement placement = place_cameras(lumpy_mesh(50, 4), options, context);
  EXPECT_FALSE(placement.cover->reached);
  EXPECT_NE(warning.find("4 times"), std::string::npos) << warning;
  const std::string missed = percent(1 - placement.cover->coverage, 2) + " less than the 100";
  EXPECT_NE(warning.find(missed), std::string::npos) << warning;
}

TEST(CoverCameras, OddSurfaces) {
  TriangleMesh triangle;
  triangle.vertices = {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}};
  triangle.faces = {{0, 1, 2}};
  const Placement placement = place_cameras(triangle, covering());
  EXPECT_TRUE(placement.cover->reached);
  EXPECT_GE(placement.cover->for_coverage, 2u);
  EXPECT_TRUE(place_cameras(scaled(lumpy_mesh(50, 3), 1e-4), covering()).cover->reached);
  EXPECT_TRUE(place_cameras(scaled(lumpy_mesh(50, 3), 1e5), covering()).cover->reached);
  EXPECT_THROW(place_cameras({}, covering()), BadDataError);
  triangle.vertices[1] = {0, 3, 0};  // no area left
  EXPECT_THROW(place_cameras(triangle, covering()), BadDataError);
  triangle.vertices[1].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(place_cameras(triangle, covering()), BadDataError);
  PlacementOptions fine = covering();
  fine.coverage->texel_mm = 1e-6;
  EXPECT_THROW(place_cameras(lumpy_mesh(50, 3), fine), BadDataError);
}

TEST(MeasureCoverage, AllOfASphereIsSeenAndNothingInsideIt) {
  const PlacementOptions options;
  const TriangleMesh sphere = sphere_mesh(50, 4);
  const CoverageReport report = measure_coverage(sphere, place_cameras(sphere, options), options);
  EXPECT_EQ(report.reachable_share, 1);
  EXPECT_EQ(report.hidden_share, 0);
  EXPECT_GE(report.at_rest.gaps.size(), 500u);
  EXPECT_GE(report.seen_share[0], report.seen_share[1]);
  EXPECT_GT(report.median_texel_mm, 0);
  // An inner sphere of half the radius has a fifth of all area.
  const TriangleMesh both = joined(sphere, sphere_mesh(25, 4));
  const CoverageReport hollow = measure_coverage(both, place_cameras(both, options), options);
  EXPECT_NEAR(hollow.hidden_share, 0.2, 1e-3);
  EXPECT_NEAR(hollow.reachable_share, 0.8, 1e-3);
  EXPECT_NEAR(hollow.seen_share[0], report.seen_share[0], kSampling);
  // Grey inside; something is seen by two, which is green.
  EXPECT_EQ(hollow.painted.colors.back(), Eigen::Vector3f(0.2f, 0.2f, 0.2f));
  EXPECT_EQ(hollow.painted.faces, both.faces);
}

// Of 4,096 samples: three standard errors of a share near one half.
constexpr double kBriefShare = 0.024;

TEST(MeasureCoverage, ABriefReportAgreesWithTheFullOne) {
  const TriangleMesh lump = lumpy_mesh(50, 3);
  PlacementOptions options;
  options.count = 6;
  const Placement placement = place_cameras(lump, options);
  const CoverageReport full = measure_coverage(lump, placement, options);
  const CoverageReport brief = measure_coverage(lump, placement, options, CoverageDetail::brief);
  EXPECT_NEAR(brief.reachable_share, full.reachable_share, kBriefShare);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(brief.seen_share[k], full.seen_share[k], kBriefShare);
  EXPECT_TRUE(brief.at_rest.gaps.empty());
  EXPECT_TRUE(brief.poked.empty());
  EXPECT_TRUE(brief.painted.empty());
}

TEST(MeasureCoverage, FewAndManyCameras) {
  const TriangleMesh lump = lumpy_mesh(50, 3);
  for (const int count : {1, 2, 3, 4, 200}) {
    PlacementOptions options;
    options.count = count;
    const CoverageReport report = measure_coverage(lump, place_cameras(lump, options), options);
    EXPECT_EQ(report.poked.size(), 3u);
    for (std::size_t k = static_cast<std::size_t>(count); k < 3; ++k) {
      EXPECT_EQ(report.seen_share[k], 0);
    }
    if (count == 1) {
      EXPECT_GT(report.at_rest.mean_gap, 0.3);
    }
    if (count == 200) {
      EXPECT_EQ(report.seen_share[2], 1);
      EXPECT_LT(report.at_rest.mean_gap, 1e-4);
    }
  }
}

TEST(CertifyViews, ACameraKeepsWhatItSeesAndNothingOfTheFarSide) {
  const TriangleMesh sphere = sphere_mesh(50, 4);
  const SurfaceSamples samples = sample_surface(sphere, 2000, 1);
  const Sight sight(sphere);
  ViewManifold manifold;
  manifold.directions = {{0, 0, 1}};
  const std::vector<Eigen::Vector3d> views = {{0, 0, 200}, {0, 0, -200}};
  std::vector<Eye> eyes;
  for (const Eigen::Vector3d& view : views) eyes.push_back({view, -view.normalized(), 1});
  const auto seen = sight.seen_from_each(eyes, samples, {});
  const ViewCertificate certificate = certify_views(manifold, {seen[0]}, views, seen, samples);
  EXPECT_EQ(certificate.gaps, (std::vector<double>{0, 1}));
  EXPECT_EQ(certificate.mean_gap, 0.5);
}

TEST(PokedSurface, MovesTheSiteAndLeavesTheFarSide) {
  const TriangleMesh sphere = sphere_mesh(50, 3);
  const Poke poke{sphere.vertices[0], -0.6 * sphere.vertices[0], 24};
  const TriangleMesh poked = poked_surface(sphere, poke);
  EXPECT_LT((poked.vertices[0] - 0.4 * sphere.vertices[0]).norm(), 1e-12);
  double least = 1e300;
  for (std::size_t v = 0; v < sphere.vertices.size(); ++v) {
    if (sphere.vertices[v].dot(sphere.vertices[0]) > -2400) continue;
    least = std::min(least, (poked.vertices[v] - sphere.vertices[v]).norm());
  }
  EXPECT_LT(least, 0.01);  // 100 mm away: e^(−8.7) of 30 mm
  EXPECT_GT(signed_volume(poked), 0.5 * signed_volume(sphere));
  EXPECT_LT(signed_volume(poked), signed_volume(sphere));
}

constexpr double kRadius = 50, kDistance = 180;
constexpr std::size_t kSamples = 20'000;
// Stratified samples: far better than 1/√n, and the facets stand 0.1 mm inside the sphere.
constexpr double kSightSampling = 3e-3;

Eye eye_from(const Eigen::Vector3d& direction, double focal_px = 1000) {
  return {kDistance * direction, -direction, focal_px};
}

double seen_share(const SightLimits& limits) {
  const TriangleMesh sphere = sphere_mesh(kRadius, 5);
  const SurfaceSamples samples = sample_surface(sphere, kSamples, 7);
  const SampleBits seen = Sight(sphere).seen_from(eye_from({0.6, 0, 0.8}), samples, limits);
  return static_cast<double>(seen.count()) / kSamples;
}

double cap_share(double angle_rad) { return 0.5 * (1 - std::cos(angle_rad)); }

TEST(Sight, ASphereShowsTheCapOfTheClosedForm) {
  EXPECT_NEAR(seen_share({}), cap_share(std::acos(kRadius / kDistance)), kSightSampling);
  // Seen at an angle i from the normal, a point stands i − asin(R sin i / D) from the axis.
  const double sixty = std::numbers::pi / 3;
  EXPECT_NEAR(seen_share({.least_cosine = 0.5}),
              cap_share(sixty - std::asin(kRadius * std::sin(sixty) / kDistance)), kSightSampling);
}

TEST(Sight, TexelsGrowWithDepthAndSlant) {
  // Straight on at depth 130 mm with 1000 px a texel is 0.13 mm: smaller ones are asked for …
  EXPECT_EQ(seen_share({.texel_mm = 0.1299}), 0);
  // … or twice as large: as far as slant and depth together allow, which a bisection tells.
  double low = 0, high = std::acos(kRadius / kDistance);
  for (int i = 0; i < 60; ++i) {
    const double angle = 0.5 * (low + high);
    const double depth = kDistance - kRadius * std::cos(angle);
    const double off_axis = std::atan2(kRadius * std::sin(angle), depth);
    (depth / 1000 / std::cos(angle + off_axis) < 0.26 ? low : high) = angle;
  }
  EXPECT_NEAR(seen_share({.texel_mm = 0.26}), cap_share(low), kSightSampling);
}

TEST(Sight, NothingIsSeenThroughAWallOrFromBehind) {
  const TriangleMesh inner = sphere_mesh(10, 4), outer = sphere_mesh(40, 4);
  const TriangleMesh both = joined(inner, outer);
  const SurfaceSamples samples = sample_surface(both, kSamples, 1);
  const SampleBits seen = Sight(both).seen_from_any(
      {eye_from({1, 0, 0}), eye_from({0, 1, 0}), eye_from({-1, 0, 0})}, samples, {});
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_FALSE(samples.points[i].norm() < 20 && seen.test(i));
  }
  EXPECT_GT(seen.count(), kSamples / 2);
}

TEST(Sight, AnyIsTheUnionOfEach) {
  const TriangleMesh lump = lumpy_mesh(kRadius, 4);
  const SurfaceSamples samples = sample_surface(lump, 1000, 3);  // no multiple of a chunk
  const Sight sight(lump);
  const std::vector<Eye> eyes = {eye_from({1, 0, 0}), eye_from({0, 0, 1}), eye_from({0, -1, 0}),
                                 eye_from({0.6, 0.8, 0})};
  const SightLimits limits{.least_cosine = 0.5};
  SampleBits united(samples.size());
  for (const SampleBits& seen : sight.seen_from_each(eyes, samples, limits)) {
    for (std::size_t w = 0; w < seen.words().size(); ++w) united.words()[w] |= seen.words()[w];
  }
  const SampleBits any = sight.seen_from_any(eyes, samples, limits);
  for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(any.test(i), united.test(i)) << i;
}

TEST(SampleSurface, RefusesSurfacesWithoutArea) {
  EXPECT_THROW(sample_surface({}, 10, 1), BadDataError);
  TriangleMesh flat = tetrahedron_mesh();
  flat.vertices.assign(4, {1, 2, 3});
  EXPECT_THROW(sample_surface(flat, 10, 1), BadDataError);
  flat.vertices[0].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(sample_surface(flat, 10, 1), BadDataError);
}

}  // namespace
}  // namespace organbake
