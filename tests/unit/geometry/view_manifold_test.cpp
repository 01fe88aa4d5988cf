// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/view_manifold.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "organbake/core/random.h"
#include "support/meshes.h"

namespace organbake {
namespace {

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
  for (int i = 0; i < 3; ++i) {
    if (w.weights[i] > 0) sum[w.cameras[i]] += w.weights[i];
  }
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
  for (int i = 0; i < 3; ++i) {
    cap.directions.push_back(Eigen::Vector3d(std::cos(2.1 * i), std::sin(2.1 * i), 2).normalized());
  }
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
