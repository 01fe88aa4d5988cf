// SPDX-License-Identifier: GPL-3.0-or-later
// A real head, scanned with the gantry tilted by 18.5° and in slices of unequal distance.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/volume/read_volume.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

const Volume& tilted_head() {
  static const Volume head = read_volume(shared_data("dicom/tilted_head"));
  return head;
}

double trilinear(const Volume& volume, const Eigen::Vector3d& world_mm) {
  const Eigen::Vector3d index = volume.index_from_world(world_mm);
  const Eigen::Vector3i low = index.array().floor().cast<int>();
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3i at = low;
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const int up = corner >> axis & 1;
      at[axis] = std::clamp(low[axis] + up, 0, volume.size[axis] - 1);
      weight *= up ? index[axis] - low[axis] : 1 - (index[axis] - low[axis]);
    }
    sum += weight * volume.at(at.x(), at.y(), at.z());
  }
  return sum;
}

// The head lies turned by 11°. Its middle plane was found once, from outside, by turning and
// shifting a mirror until the head and its mirror image differed least.
struct HeadAxes {
  Eigen::Vector3d middle, left, back, up;
};

HeadAxes head_axes(const Volume& head) {
  HeadAxes axes;
  axes.left = Eigen::Vector3d(0.9807, -0.1952, -0.0137).normalized();
  const Eigen::Vector3d across = head.direction.col(2);
  axes.up = (across - across.dot(axes.left) * axes.left).normalized();
  axes.back = axes.up.cross(axes.left);
  const double plane_mm = -3.21;
  const Eigen::Vector3d point(-8.8, -26.2, -26.0);
  axes.middle = point - (point.dot(axes.left) - plane_mm) * axes.left;
  return axes;
}

// Centre of the air in the bony part of one ear canal: how far to the side, back and up.
Eigen::Vector3d ear_canal(const Volume& head, double side) {
  const HeadAxes axes = head_axes(head);
  constexpr double kStep_mm = 0.5, kAir_hu = -300;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int voxels = 0;
  for (double out = 42; out < 50; out += kStep_mm) {
    for (double back = 18; back < 32; back += kStep_mm) {
      for (double up = 14; up < 30; up += kStep_mm) {
        const Eigen::Vector3d at =
            axes.middle + side * out * axes.left + back * axes.back + up * axes.up;
        if (trilinear(head, at) >= kAir_hu) continue;
        sum += Eigen::Vector3d(out, back, up);
        ++voxels;
      }
    }
  }
  EXPECT_GT(voxels, 500) << "no ear canal on side " << side;
  return sum / std::max(1, voxels);
}

TEST(TiltedHead, EarCanalsAreSymmetricToTheMiddle) {
  REQUIRE_SHARED_DATA("dicom/tilted_head");
  const Eigen::Vector3d left = ear_canal(tilted_head(), 1), right = ear_canal(tilted_head(), -1);
  EXPECT_LT((left - right).norm(), 2.0) << left.transpose() << " | " << right.transpose();
}

TEST(TiltedHead, TellsGapsAndTiltAsScanned) {
  REQUIRE_SHARED_DATA("dicom/tilted_head");
  const Volume& head = tilted_head();
  EXPECT_NEAR(head.gantry_tilt_degrees, 18.5, 0.01);
  const std::vector<double> gaps = slice_gaps_mm(head);
  ASSERT_EQ(gaps.size(), 27u);
  const auto count = [&](double gap_mm) {
    return std::count_if(gaps.begin(), gaps.end(),
                         [&](double gap) { return std::abs(gap - gap_mm) < 0.01; });
  };
  EXPECT_EQ(count(4.0), 13);
  EXPECT_EQ(count(7.0), 13);
  EXPECT_EQ(count(1.08), 1);
  EXPECT_GE(value_range(head).min, -1024);  // the padding of −1500 is gone
}

}  // namespace
}  // namespace organbake
