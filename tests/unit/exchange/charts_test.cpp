// SPDX-License-Identifier: GPL-3.0-or-later
#include "charts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/meshes.h"

namespace organbake {
namespace {

double flat_area(const TriangleMesh& mesh, const Chart& chart, std::uint32_t face) {
  const Face& f = mesh.faces[face];
  const Eigen::Vector2d a = chart.flat(mesh.vertices[f[0]]), b = chart.flat(mesh.vertices[f[1]]),
                        c = chart.flat(mesh.vertices[f[2]]);
  return 0.5 * ((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x());
}

// A ramp that winds round an axis and lies over itself: each face looks along the axis.
TriangleMesh spiral_ramp() {
  TriangleMesh mesh;
  constexpr int kSteps = 60;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = 4 * M_PI * i / kSteps;
    for (const double r : {20.0, 30.0})
      mesh.vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), 0.5 * i);
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    mesh.faces.push_back({2 * i, 2 * i + 1, 2 * i + 3});
    mesh.faces.push_back({2 * i, 2 * i + 3, 2 * i + 2});
  }
  return mesh;
}

TEST(Charts, HoldEveryFaceOnceWithoutShrinkingIt) {
  for (const TriangleMesh& mesh : {lumpy_mesh(40, 4), box_mesh({10, 20, 30}), spiral_ramp()}) {
    std::vector<int> held(mesh.faces.size(), 0);
    for (const Chart& chart : cut_into_charts(mesh)) {
      EXPECT_NEAR(chart.u.cross(chart.v).dot(chart.axis), 1, 1e-12);
      for (const std::uint32_t face : chart.faces) {
        ++held[face];
        EXPECT_GT(flat_area(mesh, chart, face), 0.64 * face_area(mesh, face));
      }
    }
    EXPECT_EQ(std::count(held.begin(), held.end(), 1), std::ptrdiff_t(held.size()));
  }
}

TEST(Charts, AreFew) {
  EXPECT_EQ(cut_into_charts(box_mesh({10, 20, 30})).size(), 6u);
  // A cap of 50° is a sixth of a sphere; greedy cutting takes a few times as many as must be.
  EXPECT_LE(cut_into_charts(sphere_mesh(40, 4)).size(), 20u);
}

TEST(Charts, DoNotLieOverThemselves) {
  const TriangleMesh ramp = spiral_ramp();
  const std::vector<Chart> charts = cut_into_charts(ramp);
  EXPECT_GE(charts.size(), 2u);
  for (const Chart& chart : charts) {
    // No middle of a face lies inside another.
    for (const std::uint32_t f : chart.faces) {
      Eigen::Vector2d middle = Eigen::Vector2d::Zero();
      for (const std::uint32_t v : ramp.faces[f]) middle += chart.flat(ramp.vertices[v]) / 3;
      for (const std::uint32_t g : chart.faces) {
        if (f == g) continue;
        int left = 0;
        for (int k = 0; k < 3; ++k) {
          const Eigen::Vector2d a = chart.flat(ramp.vertices[ramp.faces[g][k]]),
                                b = chart.flat(ramp.vertices[ramp.faces[g][(k + 1) % 3]]);
          left += (b - a).x() * (middle - a).y() - (b - a).y() * (middle - a).x() > 0;
        }
        EXPECT_LT(left, 3) << f << " lies in " << g;
      }
    }
  }
}

TEST(Packing, KeepsMarginsAndFillsTheSquare) {
  std::vector<Eigen::Vector2d> sizes;
  double area = 0;
  for (int i = 0; i < 40; ++i) {
    sizes.emplace_back(3 + (i * 7) % 11, 2 + (i * 5) % 9);
    area += sizes.back().prod();
  }
  constexpr int kMargin = 4, kSide = 512;
  const PackedRectangles packed = pack_rectangles(sizes, kMargin, kSide, 1e3);
  ASSERT_EQ(packed.corners.size(), sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const Eigen::Vector2d low = packed.corners[i].cast<double>(),
                          high = low + packed.scale * sizes[i];
    EXPECT_GE(low.minCoeff(), kMargin);
    EXPECT_LE(high.maxCoeff(), kSide - kMargin);
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::Vector2d other = packed.corners[j].cast<double>(),
                            end = other + packed.scale * sizes[j];
      const bool apart = low.x() >= end.x() + 2 * kMargin || other.x() >= high.x() + 2 * kMargin ||
                         low.y() >= end.y() + 2 * kMargin || other.y() >= high.y() + 2 * kMargin;
      EXPECT_TRUE(apart) << i << " and " << j;
    }
  }
  EXPECT_GT(packed.scale * packed.scale * area, 0.6 * kSide * kSide);
  EXPECT_EQ(pack_rectangles(sizes, kMargin, kSide, 2).scale, 2) << "no larger than is wanted";
  EXPECT_EQ(pack_rectangles(sizes, 40, 64, 1).scale, 0) << "margins alone don't fit";
}

}  // namespace
}  // namespace organbake
