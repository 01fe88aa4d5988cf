// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/cut_body.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <numeric>

#include "refinement.h"
#include "support/cut_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Six times the volume over the cube of the longest edge: 1/√2 for a regular tetrahedron.
double roundness(const TetrahedralBody& body, const Tetrahedron& t) {
  return 6 * volume_of(body, t) / std::pow(longest_edge_mm(body, t), 3);
}

double least_roundness(const TetrahedralBody& body) {
  double least = 1;
  for (const Tetrahedron& t : body.tetrahedra) least = std::min(least, roundness(body, t));
  return least;
}

// mm², of the faces that one tetrahedron alone has; where two do not match, that is too much.
double outer_area(const TetrahedralBody& body) {
  std::map<std::array<std::uint32_t, 3>, int> times;
  for (const Tetrahedron& t : body.tetrahedra) {
    for (int k = 0; k < 4; ++k) {
      std::array<std::uint32_t, 3> face{t.nodes[(k + 1) % 4], t.nodes[(k + 2) % 4],
                                        t.nodes[(k + 3) % 4]};
      std::sort(face.begin(), face.end());
      ++times[face];
    }
  }
  double area = 0;
  for (const auto& [face, count] : times) {
    EXPECT_LE(count, 2);
    const auto& at = body.nodes_mm;
    if (count == 1) area += (at[face[1]] - at[face[0]]).cross(at[face[2]] - at[face[0]]).norm() / 2;
  }
  return area;
}

TEST(EdgeBisection, FillsTheBodyWithSoundTetrahedraThatMatch) {
  TetrahedralBody body = test::block({6, 4, 4}, 10);
  body.anchors = {0, 1, 2, 3, 4, 5, 6};
  const double whole = test::volume_mm3(body), round = least_roundness(body);
  const std::size_t before = body.tetrahedra.size();
  const auto near = [](const TetrahedralBody& b, const Tetrahedron& t) {
    return std::any_of(t.nodes.begin(), t.nodes.end(), [&](std::uint32_t n) {
      return (b.nodes_mm[n] - Vector3d(33, 20, 20)).norm() < 9;
    });
  };
  const Bisection halved = bisect(body, [&](std::uint32_t t) {
    return near(body, body.tetrahedra[t]) && longest_edge_mm(body, body.tetrahedra[t]) > 4;
  });
  ASSERT_FALSE(halved.none());
  EXPECT_GT(body.tetrahedra.size(), before + 500);
  EXPECT_LT(body.tetrahedra.size(), 8000u);  // what lies far off stays as it was
  ASSERT_EQ(halved.part_of.size(), body.tetrahedra.size());
  EXPECT_NEAR(test::volume_mm3(body), whole, 1e-9 * whole);
  for (const Tetrahedron& t : body.tetrahedra) {
    ASSERT_GT(volume_of(body, t), 0);
    ASSERT_TRUE(!near(body, t) || longest_edge_mm(body, t) <= 4);
  }
  EXPECT_GT(least_roundness(body), round / 6);
  const TetrahedralBody uncut = test::block({6, 4, 4}, 10);
  EXPECT_NEAR(outer_area(body), outer_area(uncut), 1e-6 * outer_area(uncut));
  std::vector<double> volume(before, 0.0);
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t)
    volume[halved.part_of[t]] += volume_of(body, body.tetrahedra[t]);
  for (std::size_t t = 0; t < before; ++t)
    ASSERT_NEAR(volume[t], volume_of(uncut, uncut.tetrahedra[t]), 1e-9);
}

// A blade drawn through from the side, step by step.
struct DrawnBlade {
  CutBody body;
  CutSheet sheet;
  std::size_t taken = 0;

  explicit DrawnBlade(const TetrahedralBody& uncut)
      : body(uncut), sheet(body.grid(), body.first_free_rank()) {
    sheet.begin_stroke();
  }
  bool to(double y) {
    BladeLine line;
    line.top_is_out = true;
    for (int k = 0; k < BladeLine::kRows; ++k) line.points_mm[k] = Vector3d(33.1, y, 12 + 4.0 * k);
    sheet.add(line);
    const std::size_t first_new = std::exchange(taken, sheet.triangles().size());
    return body.add(sheet.triangles(), first_new);
  }
};

// Nodes of finer tetrahedra come from where they lay, on their own side of the cut.
TEST(CutBody, WhatIsMadeFinerStaysWhereItLies) {
  DrawnBlade blade(test::block({6, 4, 4}, 10));
  std::vector<Vector3d> lies = blade.body.uncut().nodes_mm;
  // Sides move apart once they can; what holds together is bent.
  const auto moved = [](const Vector3d& at, bool right) {
    return Vector3d(at + Vector3d(right ? 3 : -1, 0.02 * at.z(), 0.01 * at.x()));
  };
  for (int step = 0; step <= 10; ++step) {
    const CutBody before = blade.body;
    if (!blade.to(-4 + 4.0 * step)) continue;
    const std::vector<NodeSource> sources = blade.body.sources(before);
    ASSERT_EQ(sources.size(), blade.body.cut().node_count());
    std::vector<Vector3d> rest, now;
    for (const NodeSource& source : sources) {
      Vector3d at = Vector3d::Zero(), place = Vector3d::Zero();
      for (int k = 0; k < 4; ++k) {
        if (source.weights[k] == 0) continue;
        ASSERT_LT(source.nodes[k], before.cut().node_count());
        ASSERT_GE(source.weights[k], -1e-9);
        at += source.weights[k] * lies[source.nodes[k]];
        place +=
            source.weights[k] * before.uncut().nodes_mm[before.cut().original(source.nodes[k])];
      }
      now.push_back(at), rest.push_back(place);
    }
    for (std::uint32_t n = 0; n < rest.size(); ++n) {
      const Vector3d& own = blade.body.uncut().nodes_mm[blade.body.cut().original(n)];
      ASSERT_LT((rest[n] - own).norm(), 1e-9);
    }
    lies = now;
    for (std::uint32_t c = 0; c < blade.body.cut().copies().size(); ++c) {
      const auto& copy = blade.body.cut().copies()[c];
      if (!blade.body.cut().split(copy.tetrahedron)) continue;
      const auto held = blade.body.cut().held_corner(c);
      const std::uint32_t node = blade.body.uncut().tetrahedra[held.tetrahedron].nodes[held.corner];
      const Vector3d& at = blade.body.uncut().nodes_mm[node];
      lies[copy.nodes[held.corner]] = moved(at, at.x() > 33.1);
    }
  }
  EXPECT_EQ(blade.body.cut().fragment_count(), 1u);
  EXPECT_GT(blade.body.uncut().tetrahedra.size(), 1500u);
  const auto volumes = blade.body.cut().fragment_volumes(blade.body.uncut());
  const double whole = test::volume_mm3(test::block({6, 4, 4}, 10));
  EXPECT_NEAR(std::accumulate(volumes.begin(), volumes.end(), 0.0), whole, 1e-6 * whole);
}

}  // namespace
}  // namespace organbake
