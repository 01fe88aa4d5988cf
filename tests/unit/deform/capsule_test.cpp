// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/deform/deformer.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kOnCapsule_mm = 0.1;  // what a contact must hold to
constexpr double kRadius_mm = 4;

Instrument capsule(const Vector3d& from_mm, const Vector3d& axis_mm) {
  Instrument tip;
  tip.active = true;
  tip.radius_mm = kRadius_mm;
  tip.position_mm = from_mm;
  tip.axis_mm = axis_mm;
  return tip;
}

double distance_to_axis(const Instrument& tip, const Vector3d& point) {
  const double t = (point - tip.position_mm).dot(tip.axis_mm) / tip.axis_mm.squaredNorm();
  return (tip.position_mm + std::clamp(t, 0.0, 1.0) * tip.axis_mm - point).norm();
}

// Over a fine grid of points of every face: without a base layer the proxy is the skin.
double skin_to_axis(const TriangleMesh& mesh, const Deformer& deformer, const Instrument& tip) {
  constexpr int kSteps = 12;
  const auto& at = deformer.positions();
  double nearest = std::numeric_limits<double>::infinity();
  for (const Face& f : mesh.faces) {
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        const double u = double(i) / kSteps, v = double(j) / kSteps;
        const Vector3d p = (1 - u - v) * at[f[0]] + u * at[f[1]] + v * at[f[2]];
        nearest = std::min(nearest, distance_to_axis(tip, p));
      }
    }
  }
  return nearest;
}

TEST(Capsule, TheSkinLiesAlongItsWholeLength) {
  const TriangleMesh mesh = test::geodesic_sphere(7, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  StepReport report;
  Instrument tip;
  for (int step = 0; step <= 90; ++step) {
    const double height_mm = 46 - 12 * std::min(1.0, step / 60.0);
    tip = capsule({-15, 1, height_mm}, {30, 0, 0});
    report = deformer.step({tip});
  }
  EXPECT_GT(skin_to_axis(mesh, deformer, tip), kRadius_mm - kOnCapsule_mm);
  EXPECT_LT(skin_to_axis(mesh, deformer, tip), kRadius_mm + kOnCapsule_mm);
  EXPECT_GT(report.contacts, 3u);
  EXPECT_GT(report.tip_force_n[0].z(), 0) << "the tissue pushes the tip out";
  // A ball at the middle alone would leave the skin under the ends where the sphere was.
  const auto highest_near = [&](double x_mm) {
    double z = 0;
    for (const Vector3d& p : deformer.positions())
      if (std::abs(p.x() - x_mm) < 4 && std::abs(p.y()) < 4) z = std::max(z, p.z());
    return z;
  };
  const double axis_mm = tip.position_mm.z();
  for (const double x_mm : {-10.0, 0.0, 10.0}) EXPECT_LT(highest_near(x_mm), axis_mm) << x_mm;
}

TEST(Capsule, EitherEndMayBeItsPosition) {
  constexpr double kSame_mm = 0.1;  // the deepest points are sought from the same starts
  const TriangleMesh mesh = test::geodesic_sphere(4, 40);
  Deformer one(mesh, test::spring_body(mesh), {}), other(mesh, test::spring_body(mesh), {});
  for (int step = 0; step <= 60; ++step) {
    const double height_mm = 46 - 8 * step / 60.0;
    one.step({capsule({-10, 2, height_mm}, {20, 0, 0})});
    other.step({capsule({10, 2, height_mm}, {-20, 0, 0})});
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_LT((one.positions()[v] - other.positions()[v]).norm(), kSame_mm);
}

TEST(Capsule, AFastOneDoesNotTunnel) {
  for (const double deep_mm : {25.0, 10.0}) {
    const TriangleMesh mesh = test::geodesic_sphere(4, 40);
    Deformer deformer(mesh, test::spring_body(mesh), {});
    deformer.step({capsule({-12, 1, 70}, {24, 0, 0})});
    const Instrument tip = capsule({-12, 1, deep_mm}, {24, 0, 0});  // in one step of 1/60 s
    for (int step = 0; step < 30; ++step) deformer.step({tip});
    // After the blow the skin is folded round the capsule: each face is held at its deepest points
    // alone, up to the tip's most contacts. Rounding decides how it folds: forty starts that differ
    // by 1e-9 mm fold in four ways, 0.03 to 0.31 mm into the capsule.
    constexpr double kFolded_mm = 0.35;
    EXPECT_GT(skin_to_axis(mesh, deformer, tip), kRadius_mm - kFolded_mm) << deep_mm;
    for (const Vector3d& p : deformer.positions()) {
      if (std::abs(p.x()) < 8 && std::abs(p.y() - 1) < 2) {
        EXPECT_LT(p.z(), deep_mm) << "skin was left above";
      }
    }
  }
}

// The far end swings through half a turn's chord while the position hardly moves.
TEST(Capsule, AFastSwingDoesNotTunnel) {
  const TriangleMesh mesh = test::geodesic_sphere(4, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  deformer.step({capsule({-70, 0, 30}, {50, 0, 50})});
  const Instrument tip = capsule({-70, 0, 30}, {75, 0, 0});
  for (int step = 0; step < 10; ++step) deformer.step({tip});
  EXPECT_GT(skin_to_axis(mesh, deformer, tip), kRadius_mm - kOnCapsule_mm);
  EXPECT_LT(deformer.positions()[0].norm(), 100) << "pushed, not thrown";
}

TEST(Capsule, AnAxisThatMakesNoSenseIsRefused) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  EXPECT_THROW(deformer.step({capsule({0, 0, 50}, {std::nan(""), 0, 0})}), UsageError);
  EXPECT_THROW(deformer.step({capsule({0, 0, 50}, {0, 1e300, 0})}), UsageError);
}

}  // namespace
}  // namespace organbake
