// SPDX-License-Identifier: GPL-3.0-or-later

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/decimate/decimate.h"
#include "organbake/geometry/mesh_checks.h"
#include "proxies.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// A closed plate with `holes` square holes through it: genus = holes. Each cell of its plan has
// `fine`² squares; its thickness is `layers` squares of side 1 mm.
TriangleMesh perforated_plate(int holes, int fine, int layers) {
  const int columns = 2 * holes + 1, width = columns * fine, depth = 3 * fine;
  const auto solid = [&](int x, int y, int z) {
    if (x < 0 || y < 0 || z < 0 || x >= width || y >= depth || z >= layers) return false;
    return !((x / fine) % 2 == 1 && y / fine == 1);
  };
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, added] = known.emplace(at, std::uint32_t(mesh.vertices.size()));
    if (added) mesh.vertices.push_back({double(at[0]), double(at[1]), double(at[2])});
    return found->second;
  };
  for (int x = 0; x < width; ++x) {
    for (int y = 0; y < depth; ++y) {
      for (int z = 0; z < layers; ++z) {
        if (!solid(x, y, z)) continue;
        for (int axis = 0; axis < 3; ++axis) {
          for (const int side : {0, 1}) {
            std::array<int, 3> next{x, y, z};
            next[axis] += side ? 1 : -1;
            if (solid(next[0], next[1], next[2])) continue;
            const auto corner = [&](int di, int dj) {
              std::array<int, 3> at{x, y, z};
              at[axis] += side;
              at[(axis + 1) % 3] += di;
              at[(axis + 2) % 3] += dj;
              return vertex(at);
            };
            std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
            if (side == 0) std::swap(b, d);
            mesh.faces.push_back({a, b, c});
            mesh.faces.push_back({a, c, d});
          }
        }
      }
    }
  }
  return mesh;
}

// Bends a mesh by a smooth field of its seed; small enough to turn nothing inside out.
TriangleMesh bent(TriangleMesh mesh, std::uint64_t seed) {
  const double size = bounds(mesh).diagonal();
  const Eigen::Vector3d center = bounds(mesh).center();
  RandomStream random(seed);
  Eigen::Matrix3d waves, phases;
  for (int i = 0; i < 9; ++i) {
    waves(i) = random.uniform(2, 5) / size;
    phases(i) = random.uniform(0, 6.28);
  }
  for (Eigen::Vector3d& v : mesh.vertices) {
    Eigen::Vector3d by = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        by[i] += 0.03 * size * std::sin(waves(i, j) * (v[j] - center[j]) + phases(i, j));
      }
    }
    v += by;
  }
  return mesh;
}

// The mesh without the faces round a random vertex: a surface with one border loop more.
TriangleMesh opened(TriangleMesh mesh, std::uint64_t seed) {
  RandomStream random(seed);
  const Eigen::Vector3d at = mesh.vertices[random.below(mesh.vertices.size())];
  const double radius = 0.12 * bounds(mesh).diagonal();
  std::erase_if(mesh.faces,
                [&](const Face& f) { return (mesh.vertices[f[0]] - at).norm() < radius; });
  return mesh;
}

DecimateResult fitted(const TriangleMesh& mesh, std::size_t faces, bool flips = true) {
  return decimate(mesh, {.faces = faces, .flips = flips});
}

DecimateResult lindstrom_turk(const TriangleMesh& mesh, std::size_t faces) {
  return decimate(mesh, {.method = DecimateMethod::lindstrom_turk, .faces = faces});
}

TEST(FittedProxy, IsNearerThanLindstromTurkAndKeepsTheVolume) {
  const TriangleMesh mesh = lumpy_mesh(50, 4);
  const DecimateResult plain = lindstrom_turk(mesh, 80);
  for (const bool flips : {false, true}) {
    const DecimateResult s = fitted(mesh, 80, flips);
    EXPECT_LE(s.proxy.faces.size(), 80u);
    EXPECT_TRUE(s.closed_manifold);
    EXPECT_EQ(s.self_intersecting_faces, 0u);
    // Far from the 0.6…0.8 that are reached, but no collapse alone gets there.
    EXPECT_LT(s.rms_mm, 0.9 * plain.rms_mm);
    EXPECT_LT(s.reverse_rms_mm, 0.9 * plain.reverse_rms_mm);
    EXPECT_NEAR(s.volume_change, 0, 1e-6);
  }
}

TEST(FittedProxy, FlipsLowerTheDistanceFurther) {
  const TriangleMesh mesh = lumpy_mesh(50, 4);
  const DecimateResult fit = fitted(mesh, 60, false), flipped = fitted(mesh, 60, true);
  EXPECT_LT(flipped.rms_mm + flipped.reverse_rms_mm, fit.rms_mm + fit.reverse_rms_mm);
}

TEST(FittedProxy, OfASphereIsNearTheBestKnown) {
  const DecimateResult s = fitted(sphere_mesh(100, 4), 80);
  // A scaled icosphere of 80 faces reaches 1.27 % of the radius, Lindstrom–Turk 1.54 %.
  EXPECT_LT(s.rms_mm, 1.30);
  EXPECT_LT(s.reverse_rms_mm, 1.30);
}

// Of a face's normal and those of its corners: below 0 it lies folded over onto its neighbours.
double least_corner_cosine(const TriangleMesh& mesh) {
  const std::vector<Eigen::Vector3d> normals = vertex_normals(mesh);
  double least = 1;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const std::uint32_t v : mesh.faces[f])
      least = std::min(least, face_normal(mesh, f).dot(normals[v]));
  }
  return least;
}

// Bumps as fine as the faces: collapses, and many small steps of a fit, would fold slivers over.
TEST(FittedProxy, NoSliverFoldsOver) {
  TriangleMesh mesh = lumpy_mesh(50, 5);
  for (Eigen::Vector3d& v : mesh.vertices)
    v *= 1 + 0.008 * std::sin(v.x()) * std::sin(v.y() + 1) * std::sin(v.z() + 2);
  for (const std::size_t faces : {700, 2000}) {
    const DecimateResult s = fitted(mesh, faces);
    EXPECT_GT(least_corner_cosine(s.proxy), 0.1) << faces << " faces";  // were −0.98…−0.81
    EXPECT_LT(s.rms_mm, 0.92 * lindstrom_turk(mesh, faces).rms_mm);
  }
}

TEST(FittedProxy, KeepsGenusComponentsAndBorders) {
  for (const int holes : {1, 3, 5}) {
    const TriangleMesh mesh = bent(perforated_plate(holes, 5, 4), 3);
    const DecimateResult s = fitted(mesh, 160, holes == 3);
    EXPECT_TRUE(s.closed_manifold);
    EXPECT_EQ(s.genus, holes);
    EXPECT_EQ(s.components, 1u);
    // Where Lindstrom–Turk's start meets itself the fit can't always part it, but adds nothing.
    EXPECT_LE(s.self_intersecting_faces, lindstrom_turk(mesh, 160).self_intersecting_faces);
  }
  TriangleMesh many;
  for (int i = 0; i < 10; ++i) many = joined(many, moved(lumpy_mesh(10, 3), {40.0 * i, 0, 0}));
  const DecimateResult parts = fitted(many, 200, false);
  EXPECT_EQ(parts.components, 10u);
  EXPECT_EQ(parts.genus, 0);
  EXPECT_TRUE(parts.closed_manifold);
  EXPECT_THAT([&] { fitted(many, 38); }, ThrowsMessage<BadDataError>(HasSubstr("below 40 faces")));

  const DecimateResult open = fitted(opened(lumpy_mesh(50, 4), 1), 100, false);
  EXPECT_EQ(open.boundary_loops, 1u);
  EXPECT_EQ(open.genus, 0);
  EXPECT_LT(open.rms_mm, 1.5);
}

TEST(FittedProxy, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh = lumpy_mesh(50, 4);
  const TriangleMesh many = fitted(mesh, 80).proxy;
  const ThreadLimit one(1);
  const TriangleMesh single = fitted(mesh, 80).proxy;
  EXPECT_EQ(many.vertices, single.vertices);
  EXPECT_EQ(many.faces, single.faces);
}

TEST(FittedProxy, PlaceAndUnitDoNotMatter) {
  const TriangleMesh mesh = lumpy_mesh(50, 3);
  const DecimateResult here = fitted(mesh, 80, false);
  for (const double unit : {1e-3, 1e-5}) {  // a body of 0.05 mm, of half a micrometre
    const DecimateResult s = fitted(scaled(mesh, unit), 80, false);
    EXPECT_NEAR(s.rms_mm / unit, here.rms_mm, 0.05 * here.rms_mm);
  }
  // Coordinates of 1e6 mm are rounded to 1e-10 mm, which may decide a tie differently.
  const DecimateResult there = fitted(moved(mesh, {1e6, -1e6, 1e6}), 80, false);
  EXPECT_NEAR(there.rms_mm, here.rms_mm, 0.05 * here.rms_mm);
  EXPECT_NEAR(there.volume_change, 0, 1e-6);
}

TEST(FittedProxy, BadSurfacesAreRefusedOrSurvived) {
  EXPECT_THROW(fitted({}, 80), BadDataError);
  TriangleMesh mesh = lumpy_mesh(50, 3);
  mesh.vertices[5].y() = std::nan("");
  EXPECT_THAT([&] { fitted(mesh, 80); }, ThrowsMessage<BadDataError>(HasSubstr("vertex 5")));
  mesh = lumpy_mesh(50, 3);
  mesh.faces.push_back({mesh.faces[0][0], mesh.faces[0][1], mesh.faces[77][2]});
  EXPECT_THAT([&] { fitted(mesh, 80); }, ThrowsMessage<BadDataError>(HasSubstr("three or more")));
  mesh = lumpy_mesh(50, 3);  // collapsed triangles
  for (std::size_t f = 0; f < 40; ++f) {
    mesh.vertices[mesh.faces[f * 20][0]] = mesh.vertices[mesh.faces[f * 20][1]];
  }
  EXPECT_TRUE(fitted(mesh, 80, false).closed_manifold);
  EXPECT_EQ(fitted(tetrahedron_mesh(), 80).proxy.faces.size(), 4u);
  EXPECT_EQ(fitted(tetrahedron_mesh(), 4).proxy.vertices.size(), 4u);
}

TEST(FittedProxy, AFlatSidedBodyLosesNothing) {
  const DecimateResult s = fitted(grid_box({30, 20, 10}, 8), 12);
  EXPECT_NEAR(signed_volume(s.proxy), 6000, 1e-3);
  EXPECT_LT(std::max(s.max_mm, s.reverse_max_mm), 0.01);
}

TEST(FastCollapse, LeavesTheBorderWhereItIs) {
  const TriangleMesh mesh = opened(lumpy_mesh(50, 4), 1);
  const TriangleMesh thin = fast_collapse(mesh, 500);
  EXPECT_LT(thin.faces.size(), 700u);
  EXPECT_EQ(analyse_topology(thin).boundary_edges, analyse_topology(mesh).boundary_edges);
}

}  // namespace
}  // namespace organbake
