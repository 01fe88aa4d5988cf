// SPDX-License-Identifier: GPL-3.0-or-later
#include "pose/point_pairs.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

const Intrinsics kLens{800, 600, 900, 910, 405, 296, -0.1, 0.02};

RigidTransform pairs_truth() { return look_at({150, -220, 90}, {5, 3, -4}, {0, 0, 1}); }

std::vector<PointPair> pairs(int count, double noise_px) {
  RandomStream random(11);
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    PointPair pair;
    pair.point_world_mm = {random.uniform(-50, 50), random.uniform(-50, 50),
                           random.uniform(-50, 50)};
    pair.pixel = project(kLens, pairs_truth() * pair.point_world_mm) +
                 noise_px * Eigen::Vector2d(random.normal(), random.normal());
    pairs.push_back(pair);
  }
  return pairs;
}

TEST(PosePairs, ExactPairsGiveTheExactPose) {
  const RigidTransform found = pose_from_pairs(pairs(6, 0), kLens);
  EXPECT_LT((found.rotation - pairs_truth().rotation).norm(), 1e-6);
  EXPECT_LT((found.translation - pairs_truth().translation).norm(), 1e-4);
}

TEST(PosePairs, OneWrongClickHardlyMatters) {
  std::vector<PointPair> clicked = pairs(12, 0.5);
  clicked[4].pixel += Eigen::Vector2d(60, -40);
  const RigidTransform found = pose_from_pairs(clicked, kLens);
  EXPECT_LT((found.rotation - pairs_truth().rotation).norm(), 0.02);
  EXPECT_LT((found.translation - pairs_truth().translation).norm(), 3) << "mm, from 270 mm away";
}

TEST(PosePairs, TooFewOrFlatOnesAreRefused) {
  EXPECT_THROW(pose_from_pairs(pairs(5, 0), kLens), UsageError);
  std::vector<PointPair> flat = pairs(8, 0);
  for (PointPair& pair : flat) {
    pair.point_world_mm.z() = 0;
    pair.pixel = project(kLens, pairs_truth() * pair.point_world_mm);
  }
  EXPECT_THROW(pose_from_pairs(flat, kLens), UsageError);
}

}  // namespace
}  // namespace organbake
