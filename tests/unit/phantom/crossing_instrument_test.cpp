// SPDX-License-Identifier: GPL-3.0-or-later
#include "crossing_instrument.h"

#include <gtest/gtest.h>

#include <cmath>

namespace organbake {
namespace {

using Eigen::Vector3d;

TEST(CrossingInstrument, ComesAndGoes) {
  for (const double share : {0.0, 0.2, 0.3, 0.7, 1.0})
    EXPECT_FALSE(CrossingInstrument(share).inside());
  for (const double share : {0.35, 0.5, 0.65}) EXPECT_TRUE(CrossingInstrument(share).inside());
  EXPECT_FALSE(CrossingInstrument(0).first_hit({0, 0, 0}, {0, 0, 1}));
  // The tip sweeps over the tissue.
  EXPECT_GT((CrossingInstrument(0.45).tip_mm() - CrossingInstrument(0.55).tip_mm()).norm(), 3);
}

// Rays from above all over it: what they hit lies 2.5 mm from the axis or the tip, faces the eye,
// and nothing of it is farther off.
TEST(CrossingInstrument, IsAShaftOfFiveMillimetres) {
  const CrossingInstrument instrument(0.5);
  const Vector3d tip = instrument.tip_mm(), eye(5, 0, 0);
  int hits = 0, beyond = 0;
  for (double x = -40; x < 80; x += 0.7)
    for (double y = -40; y < 60; y += 0.7) {
      const Vector3d ray = Vector3d(x, y, 47) - eye;
      const auto hit = instrument.first_hit(eye, ray);
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR(hit->normal.norm(), 1, 1e-9);
      EXPECT_LT(hit->normal.dot(ray), 0);
      // 2.5 mm below the point, against its normal, is the axis: on the ball its end.
      const Vector3d inner = eye + hit->length * ray - 2.5 * hit->normal;
      beyond += (inner - tip).norm() < 1e-6;
    }
  EXPECT_GT(hits, 300);
  EXPECT_GT(beyond, 10);
}

TEST(CrossingInstrument, MissesBesideIt) {
  const CrossingInstrument instrument(0.5);
  const Vector3d tip = instrument.tip_mm(), along(0, 0, 1);
  EXPECT_TRUE(instrument.first_hit(tip - 40 * along, along));
  EXPECT_FALSE(instrument.first_hit(tip - 40 * along - Vector3d(2.6, 0, 0), along));
  EXPECT_FALSE(instrument.first_hit(tip + 40 * along, along));  // it lies behind
}

}  // namespace
}  // namespace organbake
