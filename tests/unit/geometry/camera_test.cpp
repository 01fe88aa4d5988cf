// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/camera.h"

#include <Eigen/LU>

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/geometry/view_manifold.h"
#include "support/testing.h"

namespace organbake {
namespace {

Intrinsics lens() { return {640, 480, 500, 510, 321, 238, -0.2, 0.05, 0.001, -0.002, 0.01}; }

TEST(LookAt, PutsTheTargetOnTheAxisAndUpAtTheTop) {
  const Eigen::Vector3d eye(10, -200, 30), target(1, 2, 3);
  const RigidTransform t = look_at(eye, target, Eigen::Vector3d::UnitZ());
  EXPECT_NEAR((t * eye).norm(), 0, 1e-12);
  EXPECT_NEAR((t * target - Eigen::Vector3d(0, 0, (target - eye).norm())).norm(), 0, 1e-12);
  EXPECT_LT((t * (target + Eigen::Vector3d::UnitZ())).y(), 0);  // y runs down
  // Looking along +y with z up, world +x is at the right: a mirrored frame fails here.
  EXPECT_GT((t * (target + Eigen::Vector3d::UnitX())).x(), 0);
  EXPECT_NEAR(t.rotation.determinant(), 1, 1e-12);
}

TEST(LookAt, SurvivesAnUpAlongTheView) {
  const RigidTransform t = look_at({0, 0, 10}, {0, 0, 0}, Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(t.rotation.allFinite());
  EXPECT_NEAR(t.rotation.determinant(), 1, 1e-12);
}

TEST(Project, TheCentreOfTheFirstPixelIsHalf) {
  const Intrinsics k{4, 4, 2, 2, 2, 2};
  EXPECT_EQ(project(k, {-0.75, -0.75, 1}), Eigen::Vector2d(0.5, 0.5));
}

TEST(Unproject, UndoesProjectWithDistortion) {
  constexpr double kPixelTolerance = 1e-8;  // 1e-12 of normalised coordinates × the focal length
  RandomStream random(1);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d pixel(random.uniform(0, 640), random.uniform(0, 480));
    const Eigen::Vector3d ray = unproject(lens(), pixel);
    EXPECT_EQ(ray.z(), 1);
    EXPECT_LT((project(lens(), 73.0 * ray) - pixel).norm(), kPixelTolerance);
  }
}

TEST(Intrinsics, AreChecked) {
  EXPECT_NO_THROW(lens().check());
  const auto broken = [](auto change) {
    Intrinsics k = lens();
    change(k);
    return k;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(broken([](auto& k) { k.width = 0; }).check(), BadDataError);
  EXPECT_THROW(broken([](auto& k) { k.height = 65537; }).check(), BadDataError);
  EXPECT_THROW(broken([](auto& k) { k.fx = -1; }).check(), BadDataError);
  EXPECT_THROW(broken([&](auto& k) { k.fy = nan; }).check(), BadDataError);
  EXPECT_THROW(broken([&](auto& k) { k.cx = nan; }).check(), BadDataError);
  EXPECT_THROW(broken([&](auto& k) { k.k3 = nan; }).check(), BadDataError);
}

constexpr double kDegree = 0.017453292519943295;

// Of a 1280 × 720 scope, so many degrees from side to side.
Intrinsics scope(double degrees, double k1 = -0.02, double k2 = 0.004) {
  Intrinsics k{1280, 720, 0, 0, 651, 352};
  k.model = LensModel::fisheye;
  k.k1 = k1, k.k2 = k2, k.k3 = -0.001, k.k4 = 0.0002;
  const double half = 0.5 * degrees * kDegree, h2 = half * half;
  k.fx = k.fy = 640 / (half * (1 + h2 * (k.k1 + h2 * (k.k2 + h2 * (k.k3 + h2 * k.k4)))));
  return k;
}

TEST(Fisheye, IsOpenCvsFormula) {
  const Intrinsics k = scope(140);
  const Eigen::Vector3d point(3, -4, 2.5);
  const double t = std::atan2(5, 2.5);
  const double r = t + k.k1 * std::pow(t, 3) + k.k2 * std::pow(t, 5) + k.k3 * std::pow(t, 7) +
                   k.k4 * std::pow(t, 9);
  const Eigen::Vector2d pixel = project(k, point);
  EXPECT_NEAR(pixel.x(), k.fx * r * 0.6 + k.cx, 1e-9);
  EXPECT_NEAR(pixel.y(), k.fy * r * -0.8 + k.cy, 1e-9);
  EXPECT_EQ(project(k, {0, 0, 7}), Eigen::Vector2d(k.cx, k.cy));
}

TEST(Fisheye, UnprojectUndoesProject) {
  constexpr double kPixelTolerance = 1e-9;
  RandomStream random(1);
  for (const double degrees : {100.0, 140.0, 170.0})
    for (int i = 0; i < 1000; ++i) {
      const Intrinsics k = scope(degrees, random.uniform(-0.05, 0.05), random.uniform(-0.01, 0.01));
      const double angle = random.uniform(0, 0.5 * degrees * kDegree),
                   turn = random.uniform(0, 6.28);
      const Eigen::Vector3d ray(std::tan(angle) * std::cos(turn), std::tan(angle) * std::sin(turn),
                                1);
      const Eigen::Vector2d pixel = project(k, 40 * ray);
      const Eigen::Vector3d again = unproject(k, pixel);
      EXPECT_EQ(again.z(), 1);
      EXPECT_LT((project(k, again) - pixel).norm(), kPixelTolerance) << degrees << ", " << angle;
      EXPECT_NEAR(std::atan(again.head<2>().norm()), angle, 1e-10);
    }
}

// Where its polynomial falls again no ray is known: the widest one, not one of the other branch.
TEST(Fisheye, EndsWhereItsPolynomialCeasesToRise) {
  Intrinsics k = scope(100);
  k.k1 = -0.5, k.k2 = k.k3 = k.k4 = 0;  // rises up to sqrt(2 / 3) rad
  const Eigen::Vector3d ray = unproject(k, {k.cx + k.fx, k.cy});
  EXPECT_TRUE(ray.allFinite());
  EXPECT_LT(std::atan(ray.x()), std::sqrt(2.0 / 3));
  EXPECT_GT(std::atan(ray.x()), 0.7);
}

TEST(PinholeOf, KeepsBrownsFocalLengths) {
  const Intrinsics lens{640, 480, 500, 510, 321, 238, -0.2, 0.05, 0.001, -0.002, 0.01};
  const Intrinsics pinhole = pinhole_of(lens);
  EXPECT_FALSE(pinhole.has_distortion());
  EXPECT_EQ(pinhole.fx, 500);
  EXPECT_EQ(pinhole.fy, 510);
  EXPECT_EQ(pinhole.cx, 321);
}

TEST(PinholeOf, ShowsAFisheyesMiddleUpTo120Degrees) {
  for (const double degrees : {90.0, 110.0, 140.0, 170.0}) {
    const Intrinsics lens = scope(degrees), pinhole = pinhole_of(lens);
    EXPECT_FALSE(pinhole.has_distortion());
    EXPECT_EQ(pinhole.width, lens.width);
    EXPECT_EQ(pinhole.cx, lens.cx);
    EXPECT_EQ(pinhole.fx, pinhole.fy);
    const double across = angle_across_rad(pinhole) / kDegree;
    // The axis lies a little beside the middle.
    EXPECT_NEAR(across, std::min(degrees, 120.0), 2) << degrees;
    EXPECT_NEAR(angle_across_rad(lens) / kDegree, degrees, 2);
  }
}

TEST(ScaledLens, SeesTheSameRaysAtAnotherSize) {
  const Intrinsics lens = scope(140);
  const Intrinsics half = scaled_lens(lens, 640, 360), third = scaled_lens(lens, 427, 240);
  const Eigen::Vector3d ray(0.4, -0.3, 1);
  EXPECT_LT((0.5 * project(lens, ray) - project(half, ray)).norm(), 1e-9);
  EXPECT_NEAR(project(third, ray).y(), project(lens, ray).y() / 3, 1e-9);
  EXPECT_NEAR(project(third, ray).x(), project(lens, ray).x() * 427 / 1280, 1e-9);
  // 1279 is halved to 639 by means of two pixels: the last one is lost, nothing is stretched.
  Intrinsics odd = lens;
  odd.width = 1279;
  EXPECT_EQ(scaled_lens(odd, 639, 360).fx, lens.fx / 2);
  EXPECT_TRUE(is_scaled_picture(odd, 639, 360));
  EXPECT_TRUE(is_scaled_picture(lens, 427, 240));
  EXPECT_FALSE(is_scaled_picture(lens, 640, 480));
}

ViewManifold octahedron() {
  ViewManifold m;
  m.directions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t x : {0, 1}) {
    for (std::uint32_t y : {2, 3}) {
      for (std::uint32_t z : {4, 5}) m.triangles.push_back({x, y, z});
    }
  }
  return m;
}

std::map<std::uint32_t, double> by_camera(const ViewWeights& w) {
  std::map<std::uint32_t, double> sum;
  for (int i = 0; i < 3; ++i)
    if (w.weights[i] > 0) sum[w.cameras[i]] += w.weights[i];
  return sum;
}

double largest_change(const ViewWeights& a, const ViewWeights& b) {
  auto difference = by_camera(a);
  for (const auto& [camera, weight] : by_camera(b)) difference[camera] -= weight;
  double largest = 0;
  for (const auto& [camera, d] : difference) largest = std::max(largest, std::abs(d));
  return largest;
}

TEST(ViewWeights, AreOneAtACamera) {
  const ViewManifold m = octahedron();
  for (std::uint32_t c = 0; c < m.directions.size(); ++c) {
    const auto w = by_camera(view_weights(m, 250.0 * m.directions[c]));
    ASSERT_TRUE(w.contains(c));
    EXPECT_NEAR(w.at(c), 1, 1e-12);
  }
}

TEST(ViewWeights, SumToOneAndLookTheSameWay) {
  const ViewManifold m = octahedron();
  RandomStream random(1);
  for (int i = 0; i < 10000; ++i) {
    const Eigen::Vector3d d(random.normal(), random.normal(), random.normal());
    const ViewWeights w = view_weights(m, d);
    double sum = 0;
    Eigen::Vector3d blended = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(w.weights[k], 0);
      sum += w.weights[k];
      blended += w.weights[k] * m.directions[w.cameras[k]];
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_NEAR(blended.normalized().dot(d.normalized()), 1, 1e-9);
  }
}

void expect_continuous(const ViewManifold& m, const Eigen::Vector3d& axis,
                       const Eigen::Vector3d& from) {
  constexpr double kStep = 1e-3, kSteepest = 5;  // weights change by a few per radian
  ViewWeights last = view_weights(m, from);
  for (double angle = kStep; angle < 6.3; angle += kStep) {
    const ViewWeights now = view_weights(m, Eigen::AngleAxisd(angle, axis.normalized()) * from);
    EXPECT_LT(largest_change(last, now), kSteepest * kStep) << "at " << angle << " rad";
    last = now;
  }
}

TEST(ViewWeights, AreContinuousAllRound) { expect_continuous(octahedron(), {1, 2, 3}, {3, 0, -1}); }

TEST(ViewWeights, AreContinuousAcrossTheHullsRim) {
  ViewManifold cap;
  for (int i = 0; i < 3; ++i)
    cap.directions.push_back(Eigen::Vector3d(std::cos(2.1 * i), std::sin(2.1 * i), 2).normalized());
  cap.triangles = {{0, 1, 2}};
  constexpr double kStep = 1e-3;
  ViewWeights last = view_weights(cap, {0, 0, 1});
  for (double angle = kStep; angle < 1.3; angle += kStep) {  // out through an edge and beyond
    const ViewWeights now =
        view_weights(cap, {0.3 * std::sin(angle), std::sin(angle), std::cos(angle)});
    EXPECT_LT(largest_change(last, now), 5 * kStep) << "at " << angle << " rad";
    last = now;
  }
}

TEST(ViewWeights, OneAndTwoCamerasShareWhatThereIs) {
  ViewManifold m;
  m.directions = {{1, 0, 0}};
  EXPECT_NEAR(by_camera(view_weights(m, {0, 1, 0})).at(0), 1, 1e-15);
  m.directions.push_back({0, 1, 0});
  const auto w = by_camera(view_weights(m, {1, 1, 0}));
  EXPECT_NEAR(w.at(0), 0.5, 1e-12);
  EXPECT_NEAR(w.at(1), 0.5, 1e-12);
  EXPECT_NEAR(by_camera(view_weights(m, {0, 0, 0})).at(0), 1, 1e-12);  // an eye at the centre
}

}  // namespace
}  // namespace organbake
