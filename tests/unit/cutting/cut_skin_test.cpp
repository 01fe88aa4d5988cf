// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/cut_skin.h"

#include <random>

#include "organbake/cutting/cut_body.h"
#include "refinement.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// In the plane z = 0, from the origin on.
TriangleMesh sheet_of_skin(int cells, double cell_mm) {
  TriangleMesh mesh;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x) mesh.vertices.push_back(cell_mm * Vector3d(x, y, 0));
  const auto at = [&](int x, int y) { return static_cast<std::uint32_t>(y * (cells + 1) + x); };
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      mesh.faces.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.faces.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  return mesh;
}

struct SkinCut {
  TriangleMesh skin = sheet_of_skin(12, 5);
  MaterialGrid grid{Vector3d(30, 30, 0)};
  EdgeCrossings edges{points(), edges_of(skin.faces)};
  CutSheet sheet{grid, 1000};

  std::vector<GridPoint> points() const {
    std::vector<GridPoint> points;
    for (const Vector3d& v : skin.vertices)
      points.push_back(grid.snapped(v, static_cast<std::uint32_t>(points.size())));
    return points;
  }
  CutSkin along(const std::function<Vector3d(double)>& path, int lines) {
    std::vector<Vector3d> tips;
    for (int i = 0; i < lines; ++i)
      tips.push_back(path(double(i) / (lines - 1)) - Vector3d(0, 0, 5));
    const std::size_t before = sheet.triangles().size();
    test::add_stroke(tips, {0, 0, 14}, sheet);
    edges.add(std::span(sheet.triangles()).subspan(before));
    return CutSkin(skin, edges, sheet);
  }
};

double area_of(const CutSkin& skin, const SkinPart& part) {
  const auto at = [&](int k) { return skin.vertices()[part.corners[k]].at_mm; };
  return 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).z();
}

// Parts fill their faces, without turning over.
void expect_same_area(const SkinCut& cut, const CutSkin& skin) {
  std::vector<double> of_face(cut.skin.faces.size(), 0);
  for (const SkinPart& part : skin.parts()) {
    ASSERT_GT(area_of(skin, part), 0);
    of_face[part.face] += area_of(skin, part);
  }
  for (std::size_t f = 0; f < of_face.size(); ++f)
    EXPECT_NEAR(of_face[f], face_area(cut.skin, f), 1e-9);
}

TEST(CutSkin, WithoutACutItIsAsItWas) {
  SkinCut cut;
  const CutSkin skin(cut.skin, cut.edges, cut.sheet);
  EXPECT_EQ(skin.vertices().size(), cut.skin.vertices.size());
  EXPECT_EQ(skin.parts().size(), cut.skin.faces.size());
  EXPECT_TRUE(skin.borders().empty());
}

TEST(CutSkin, TheBorderLiesOnTheBladesPath) {
  SkinCut cut;
  const auto path = [](double t) { return Vector3d(6 + 47 * t, 30 + 9 * std::sin(5 * t), 0); };
  const CutSkin skin = cut.along(path, 120);
  expect_same_area(cut, skin);
  ASSERT_GT(skin.borders().size(), 15u);
  double worst = 0, length = 0;
  for (const SkinBorder& border : skin.borders()) {
    const Vector3d a = skin.vertices()[border.left[0]].at_mm,
                   b = skin.vertices()[border.left[1]].at_mm;
    length += (b - a).norm();
    EXPECT_EQ(a, skin.vertices()[border.right[0]].at_mm);
    EXPECT_EQ(b, skin.vertices()[border.right[1]].at_mm);
    for (const Vector3d& p : {a, Vector3d(0.5 * (a + b)), b}) {
      double nearest = 1e300;
      for (int i = 0; i <= 4000; ++i) nearest = std::min(nearest, (path(i / 4000.0) - p).norm());
      worst = std::max(worst, nearest);
    }
  }
  EXPECT_LT(worst, 0.3);  // mm; 3 % of an edge for places next to its ends, 0.1 between
  double whole = 0;
  for (int i = 0; i < 4000; ++i) whole += (path((i + 1) / 4000.0) - path(i / 4000.0)).norm();
  EXPECT_GT(length, whole - 2 * 5 * std::sqrt(2.0));  // to within a face at either end
  EXPECT_LT(length, whole + 0.5);
}

// Both sides have vertices of their own, but at the ends.
TEST(CutSkin, SidesShareTheEndsOnly) {
  SkinCut cut;
  const CutSkin skin = cut.along([](double t) { return Vector3d(11 + 36 * t, 27.3, 0); }, 50);
  int shared = 0;
  for (const SkinBorder& border : skin.borders())
    shared += (border.left[0] == border.right[0]) + (border.left[1] == border.right[1]);
  EXPECT_EQ(shared, 2);
}

// A cut that passes close by a vertex parts edges a little farther in than it crosses them; the
// tissue beside it is still that of the side.
TEST(CutSkin, BesideACutThatPassesCloseByAVertexLiesItsOwnSide) {
  for (const double beside_mm : {0.004, -0.004, 0.1, 2.0}) {
    SkinCut cut;
    const CutSkin skin =
        cut.along([&](double t) { return Vector3d(4 + 50 * t, 30 + beside_mm, 0); }, 50);
    ASSERT_GT(skin.borders().size(), 10u);
    for (const SkinBorder& border : skin.borders()) {
      const auto side_of = [&](std::uint32_t from, std::uint32_t to, std::uint32_t vertex) {
        const auto& v = skin.vertices();
        const Vector3d along = v[to].at_mm - v[from].at_mm;
        return along.cross(v[vertex].side_mm - v[vertex].at_mm).z();
      };
      for (int end = 0; end < 2; ++end) {
        if (border.left[end] == border.right[end]) continue;  // one side's, at a cut's end
        EXPECT_GT(side_of(border.left[0], border.left[1], border.left[end]), 0) << beside_mm;
        EXPECT_LT(side_of(border.left[0], border.left[1], border.right[end]), 0) << beside_mm;
      }
    }
  }
}

// Along edges, through vertices, over itself and old cuts, there and back.
TEST(CutSkin, RandomStrokesKeepTheArea) {
  std::mt19937_64 random(5);
  const auto unit = [&] { return std::uniform_real_distribution<>(0, 1)(random); };
  for (int trial = 0; trial < 60; ++trial) {
    SkinCut cut;
    for (int stroke = 0; stroke < 5; ++stroke) {
      const bool on_lattice = random() % 2;
      Vector3d from(70 * unit() - 5, 70 * unit() - 5, 0), to(70 * unit() - 5, 70 * unit() - 5, 0);
      if (on_lattice) from = 5 * (from / 5).array().round(), to = 5 * (to / 5).array().round();
      const double bend = on_lattice ? 0 : 20 * unit() - 10, turns = 9 * unit();
      const CutSkin skin = cut.along(
          [&](double t) {
            return Vector3d(from + t * (to - from) +
                            bend * Vector3d(std::sin(turns * t), std::cos(turns * t), 0));
          },
          2 + static_cast<int>(random() % 60));
      expect_same_area(cut, skin);
      if (HasFatalFailure()) return;
    }
  }
}

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
  const auto volumes = test::fragment_volumes(blade.body.cut(), blade.body.uncut());
  const double whole = test::volume_mm3(test::block({6, 4, 4}, 10));
  EXPECT_NEAR(std::accumulate(volumes.begin(), volumes.end(), 0.0), whole, 1e-6 * whole);
}

}  // namespace
}  // namespace organbake
