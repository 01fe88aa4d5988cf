// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/viewpoints/sight.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/core/error.h"
#include "support/meshes.h"

namespace organbake {
namespace {

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

TEST(SampleSurface, IsEvenByAreaAndOnTheSurface) {
  // A box of 1 × 2 × 3: its sides have 2, 3 and 6 of 22.
  const SurfaceSamples samples = sample_surface(box_mesh({1, 2, 3}), 22'000, 5);
  std::array<int, 3> of_axis = {};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    Eigen::Index axis = 0;
    samples.normals[i].cwiseAbs().maxCoeff(&axis);
    ++of_axis[axis];
    const double at = samples.points[i][axis];
    EXPECT_LT(std::min(std::abs(at), std::abs(at - (axis + 1))), 1e-12);
    EXPECT_NEAR(samples.weights[i].sum(), 1, 1e-12);
  }
  EXPECT_NEAR(of_axis[0], 12'000, 4);  // stratified: off by the strata at the faces' ends
  EXPECT_NEAR(of_axis[1], 6'000, 4);
  EXPECT_NEAR(of_axis[2], 4'000, 4);
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
