// SPDX-License-Identifier: Apache-2.0

#include <random>

#include "organbake/cutting/cut_body.h"
#include "organbake/cutting/cut_sheet.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Random = std::mt19937_64;

GridPoint at(std::int64_t x, std::int64_t y, std::int64_t z, std::uint32_t rank) {
  return {{x, y, z}, rank};
}

TEST(ExactOrientation, TellsTheSides) {
  const GridPoint o = at(0, 0, 0, 0), x = at(9, 0, 0, 1), y = at(0, 9, 0, 2);
  EXPECT_EQ(orientation(o, x, y, at(3, 3, 1, 3)), 1);
  EXPECT_EQ(orientation(o, x, y, at(3, 3, -1, 3)), -1);
}

// On a grid of few places nearly all are degenerate: on planes, on lines, one on the other.
TEST(ExactOrientation, NeverContradictsItself) {
  Random random(1);
  const auto some = [&](std::uint32_t rank) {
    const auto one = [&] {
      return std::int64_t(random() % 3) * (std::int64_t{1} << 30) - (1 << 30);
    };
    return at(one(), one(), one(), rank);
  };
  for (int i = 0; i < 20000; ++i) {
    GridPoint p[4] = {some(0), some(1), some(2), some(3)};
    std::swap(p[random() % 4].rank, p[random() % 4].rank);
    const int sign = orientation(p[0], p[1], p[2], p[3]);
    ASSERT_EQ(std::abs(sign), 1);
    ASSERT_EQ(orientation(p[1], p[0], p[2], p[3]), -sign);
    ASSERT_EQ(orientation(p[1], p[2], p[0], p[3]), sign);
    ASSERT_EQ(orientation(p[0], p[1], p[3], p[2]), -sign);
  }
}

// A way from the outside crosses a closed surface an odd number of times when it ends inside,
// however it runs along the surface's edges and through its corners.
TEST(ExactOrientation, CrossingsOfAClosedSurfaceAreOddInside) {
  constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  std::array<GridPoint, 8> c;
  for (std::uint32_t k = 0; k < 8; ++k) c[k] = at((k & 1) * 2, (k >> 1 & 1) * 2, (k >> 2) * 2, k);
  Random random(2);
  for (int i = 0; i < 5000; ++i) {
    const auto coordinate = [&] { return std::int64_t(random() % 5) - 1; };
    const GridPoint from = at(coordinate(), coordinate(), coordinate(), 20);
    const GridPoint to = at(-5 + coordinate(), -7 + coordinate(), coordinate(), 21);
    int crossed = 0;
    for (const auto& s : kSides)
      crossed += crosses(from, to, {c[s[0]], c[s[1]], c[s[2]]}) +
                 crosses(from, to, {c[s[0]], c[s[2]], c[s[3]]});
    bool within = true, outside = false;
    for (const std::int64_t v : from.at) {
      within = within && v > 0 && v < 2;
      outside = outside || v < 0 || v > 2;
    }
    if (within) {
      ASSERT_EQ(crossed % 2, 1);
    }
    if (outside) {
      ASSERT_EQ(crossed % 2, 0);
    }
  }
}

TEST(ExactOrientation, FarAndUndefinedPlacesStayOnTheGrid) {
  const MaterialGrid grid(Eigen::Vector3d(10, 20, 30));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(grid.snapped({10, 20, 30}, 7).at, (std::array<std::int64_t, 3>{0, 0, 0}));
  EXPECT_EQ(grid.snapped({1e300, -1e300, nan}, 0).at,
            (std::array<std::int64_t, 3>{1ll << 31, -(1ll << 31), 1ll << 31}));
}

using Eigen::Vector3d;

// What a tip that moves along a straight line makes of a body.
struct CutOnce {
  TetrahedralBody body;
  MaterialGrid grid{Vector3d(0, 0, 0)};
  EdgeCrossings edges;
  CutSheet sheet;

  explicit CutOnce(TetrahedralBody uncut)
      : body(std::move(uncut)),
        edges(test::crossings(body, grid)),
        sheet(grid, static_cast<std::uint32_t>(body.nodes_mm.size())) {}
  CutTetrahedra stroke(const Vector3d& from, const Vector3d& to, const Vector3d& up) {
    const std::size_t before = sheet.triangles().size();
    test::add_stroke({from, to}, up, sheet);
    edges.add(std::span(sheet.triangles()).subspan(before));
    return CutTetrahedra(body, edges);
  }
};

TetrahedralBody one() {
  TetrahedralBody body;
  body.nodes_mm = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {0, 0, 10}};
  body.tetrahedra = {{{0, 1, 2, 3}, 1}};
  return body;
}

// The second beyond the first's slanted face.
TetrahedralBody two() {
  TetrahedralBody body = one();
  body.nodes_mm.push_back({10, 10, 10});
  body.tetrahedra.push_back({{4, 1, 3, 2}, 1});
  if (volume_of(body, body.tetrahedra[1]) < 0) body.tetrahedra[1].nodes = {4, 1, 2, 3};
  return body;
}

TEST(CutTetrahedra, WhatNoBladeMetIsAsItWas) {
  CutOnce cut(test::block({2, 2, 2}, 10));
  const CutTetrahedra whole = cut.stroke({-5, -5, 30}, {25, -5, 30}, {0, 0, 9});
  EXPECT_EQ(whole.fragment_count(), 1u);
  EXPECT_EQ(whole.node_count(), cut.body.nodes_mm.size());
  for (std::uint32_t t = 0; t < cut.body.tetrahedra.size(); ++t)
    EXPECT_EQ(whole.copies()[whole.first_copy(t)].nodes, cut.body.tetrahedra[t].nodes);
}

// The corner at x = 10 comes off at x = 4: 0.6³ of the volume.
TEST(CutTetrahedra, OneTetrahedronInTwo) {
  CutOnce cut(one());
  const CutTetrahedra parted = cut.stroke({4, -20, -20}, {4, 20, -20}, {0, 0, 60});
  ASSERT_EQ(parted.copies().size(), 2u);
  EXPECT_EQ(parted.fragment_count(), 2u);
  EXPECT_EQ(parted.node_count(), 8u);
  const auto volumes = test::fragment_volumes(parted, cut.body);
  const double whole = 1000.0 / 6;
  EXPECT_NEAR(volumes[parted.fragment(parted.copy_at({0, 1}))], 0.216 * whole, 1e-4 * whole);
  EXPECT_NEAR(volumes[0] + volumes[1], whole, 1e-12 * whole);
}

TEST(CutTetrahedra, ABladeThatEndsWithinLeavesItWhole) {
  CutOnce cut(one());
  const CutTetrahedra whole = cut.stroke({4, -20, 1}, {4, 20, 1}, {0, 0, 60});
  EXPECT_EQ(whole.copies().size(), 1u);
  EXPECT_EQ(whole.node_count(), 4u);
  EXPECT_EQ(whole.copies()[0].share, 1);
}

// Of two that share a face, the first is parted, the other is cut in part: both sides keep hold of
// it, and the copies that were made for the first are joined through it again.
TEST(CutTetrahedra, ACutThatEndsInTheNeighbourKeepsItsNodesShared) {
  CutOnce both(two());
  const CutTetrahedra parted = both.stroke({4, -20, -20}, {4, 20, -20}, {0, 0, 90});
  EXPECT_EQ(parted.fragment_count(), 2u);
  CutOnce cut(two());
  // Below y + z = 10 only, which is the first's alone.
  const CutTetrahedra held = cut.stroke({4, -20, -20}, {4, -20, 16}, {0, 26, 0});
  EXPECT_EQ(held.fragment_count(), 1u);
  EXPECT_FALSE(held.split(1));
}

// A plane through a block, on a plane of its nodes, along its edges, or askew.
TEST(CutTetrahedra, APlaneCutsABlockIntoItsTwoHalves) {
  const Vector3d size(50, 40, 30);
  for (const double x : {20.0, 23.7, 30.0, 0.001, 49.9}) {
    for (const double slant : {0.0, 0.2, 1.0}) {
      CutOnce cut(test::block({5, 4, 3}, 10));
      const CutTetrahedra parted =
          cut.stroke({x, -200, -200}, {x + 400 * slant, 200, -200}, {0, 0, 400});
      const auto volumes = test::fragment_volumes(parted, cut.body);
      const double sum = std::accumulate(volumes.begin(), volumes.end(), 0.0);
      EXPECT_NEAR(sum, size.prod(), 1e-9 * size.prod());
      if (slant > 0 || x < 5 || x > 45) continue;
      ASSERT_EQ(volumes.size(), 2u) << x;
      // The shares of edges that end on the plane are held off it by 3 %.
      EXPECT_NEAR(*std::min_element(volumes.begin(), volumes.end()), std::min(x, 50 - x) * 40 * 30,
                  0.012 * size.prod());
    }
  }
}

// Strokes of all kinds: through nodes, along edges, grazing, closed, crossing each other.
class RandomStrokes {
 public:
  RandomStrokes(const TetrahedralBody& body, std::uint64_t seed) : body_(body), random_(seed) {
    for (const Vector3d& n : body.nodes_mm) low_ = low_.cwiseMin(n), high_ = high_.cwiseMax(n);
  }
  void add(CutSheet& sheet) {
    const int kind = static_cast<int>(random_() % 5);
    const auto any = [&] { return kind == 0 ? node() : place(); };
    const Vector3d from = any();
    const Vector3d to = kind == 4 ? Vector3d(from + 1e-7 * place()) : any();
    Vector3d up = any();
    up -= any();
    std::vector<Vector3d> tips;
    const int lines = 2 + static_cast<int>(random_() % 14);
    for (int i = 0; i < lines; ++i) {
      const double share = double(i) / (lines - 1);
      tips.push_back(from + share * (to - from));
      if (kind == 3)
        tips.back() = from + 12 * Vector3d(std::cos(7 * share), std::sin(7 * share), 0);
    }
    if (kind == 2 || kind == 3) up = Vector3d(0, 0, 200);
    test::add_stroke(tips, up, sheet);
  }

 private:
  double unit() { return std::uniform_real_distribution<>(0, 1)(random_); }
  Vector3d node() { return body_.nodes_mm[random_() % body_.nodes_mm.size()]; }
  // Braces: in order, whatever the compiler.
  Vector3d place() { return low_ + Vector3d{unit(), unit(), unit()}.cwiseProduct(high_ - low_); }
  const TetrahedralBody& body_;
  Random random_;
  Vector3d low_ = Vector3d::Constant(1e300), high_ = Vector3d::Constant(-1e300);
};

// Skin may lie outside all tetrahedra: a whole one that is nearest, but beyond the cut, does not
// carry it.
TEST(CutBody, SkinBeyondACutGoesWithTheTissueBesideIt) {
  CutBody body(test::block({2, 2, 2}, 10));
  CutSheet sheet(body.grid(), body.first_free_rank());
  test::add_stroke({{-0.5, -20, -20}, {-0.5, 40, -20}}, {0, 0, 60}, sheet);
  body.add(sheet.triangles(), 0);
  const TissuePlace beside = body.place({15, 15, 15}, {15, 15, 15});
  const auto copy = [&](const Vector3d& at) { return body.place(at, at, &beside).copy; };
  EXPECT_EQ(copy({-1, 5, 5}), beside.copy);
  EXPECT_NE(copy({-0.2, 5, 5}), beside.copy);
}

// ORGANBAKE_CUT_SWEEPS=100000 for a run of a few minutes.
TEST(CutTetrahedra, RandomSweepsLeaveFragmentsOfTheSameVolume) {
  const char* asked = std::getenv("ORGANBAKE_CUT_SWEEPS");
  const int sweeps = asked ? std::max(1, std::atoi(asked)) : 400;
  const TetrahedralBody body = test::block({4, 3, 3}, 10);
  const double whole = test::volume_mm3(body);
  const MaterialGrid grid(Vector3d(20, 15, 15));
  const EdgeCrossings uncut = test::crossings(body, grid);
  RandomStrokes strokes(body, 11);
  int bodies = 0, parted = 0;
  for (int done = 0; done < sweeps;) {
    EdgeCrossings edges = uncut;
    CutSheet sheet(grid, static_cast<std::uint32_t>(body.nodes_mm.size()));
    for (int stroke = 0; stroke < 4; ++stroke, ++done) strokes.add(sheet);
    edges.add(sheet.triangles());
    const CutTetrahedra cut(body, edges);
    const auto volumes = test::fragment_volumes(cut, body);
    ASSERT_NEAR(std::accumulate(volumes.begin(), volumes.end(), 0.0), whole, 1e-6 * whole);
    for (const auto& copy : cut.copies()) ASSERT_GE(copy.share, 0);
    ++bodies, parted += cut.fragment_count() > 1;
  }
  EXPECT_GE(50 * parted, bodies) << "few are cut through: one in 23 was";
}

}  // namespace
}  // namespace organbake
