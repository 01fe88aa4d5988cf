// SPDX-License-Identifier: GPL-3.0-or-later
#include "tissue_parts.h"

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/mechanics/mechanics.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

double tissue_volume(const TetrahedralBody& body) {
  double sum = 0;
  for (const Tetrahedron& t : body.tetrahedra) sum += t.fill * volume_of(body, t);
  return sum;
}

Eigen::Vector3d embedded(const TetrahedralBody& body, std::size_t vertex) {
  const EmbeddedVertex& v = body.vertices[vertex];
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    sum += v.weights[k] * body.nodes_mm[body.tetrahedra[v.tetrahedron].nodes[k]];
  }
  return sum;
}

// Faces of neighbouring cells must be the same triangles, or the lattice comes apart there.
TEST(LatticeBody, HangsTogetherFaceToFace) {
  const TetrahedralBody body = make_lattice_body(box_mesh({30, 20, 20}), {}, 10);
  EXPECT_EQ(body.tetrahedra.size(), 3u * 2 * 2 * 5);
  EXPECT_EQ(body.nodes_mm.size(), 4u * 3 * 3);
  EXPECT_EQ(part_count(body), 1u);
  std::map<std::array<std::uint32_t, 3>, int> faces;
  for (const Tetrahedron& t : body.tetrahedra) {
    for (int k = 0; k < 4; ++k) {
      std::array<std::uint32_t, 3> face = {t.nodes[(k + 1) % 4], t.nodes[(k + 2) % 4],
                                           t.nodes[(k + 3) % 4]};
      std::sort(face.begin(), face.end());
      ++faces[face];
    }
  }
  const auto open =
      std::count_if(faces.begin(), faces.end(), [](auto& f) { return f.second == 1; });
  EXPECT_EQ(open, 2 * 2 * (3 * 2 + 3 * 2 + 2 * 2)) << "two triangles in each outer square";
}

TEST(LatticeBody, HoldsTheVolumeAndEveryVertex) {
  // Twelve samples a cell; in twenty faces the least fill of slivers weighs most.
  constexpr double kVolumeWithin = 0.05;
  for (const TriangleMesh& proxy : {sphere_mesh(50, 1), lumpy_mesh(50, 2), lumpy_mesh(20, 0)}) {
    const TetrahedralBody body = make_lattice_body(proxy, {}, 0);
    EXPECT_NEAR(tissue_volume(body) / signed_volume(proxy), 1, kVolumeWithin);
    EXPECT_EQ(part_count(body), 1u);
    ASSERT_EQ(body.vertices.size(), proxy.vertices.size());
    for (std::size_t v = 0; v < proxy.vertices.size(); ++v) {
      EXPECT_LT((embedded(body, v) - proxy.vertices[v]).norm(), 1e-9) << v;
    }
    for (const Tetrahedron& t : body.tetrahedra) {
      EXPECT_GT(volume_of(body, t), 0);
      EXPECT_GT(t.fill, 0);
      EXPECT_LE(t.fill, 1);
    }
  }
}

// Bodies that are moved and stretched take every vertex along, whatever its patch is bent like, and
// what is held stays held.
TEST(LatticeBody, PatchesCarryLinearFieldsExactly) {
  for (const TriangleMesh& proxy : {lumpy_mesh(50, 2), lumpy_mesh(50, 1)}) {
    const TetrahedralBody body = make_lattice_body(proxy, {3, 7}, 0);
    ASSERT_EQ(body.patches.size(), proxy.vertices.size());
    std::size_t wide = 0;
    for (std::size_t v = 0; v < proxy.vertices.size(); ++v) {
      double sum = 0, largest = 0;
      Eigen::Vector3d at = Eigen::Vector3d::Zero();
      for (const auto& [node, weight] : body.patches[v]) {
        sum += weight, at += weight * body.nodes_mm[node];
        largest = std::max(largest, weight);
      }
      EXPECT_NEAR(sum, 1, 1e-9);
      EXPECT_LT((at - proxy.vertices[v]).norm(), 1e-9) << v;
      wide += body.patches[v].size() > 4 && largest < 0.5;
    }
    EXPECT_GT(wide, proxy.vertices.size() / 2);  // most stand for more than one tetrahedron
    for (const std::uint32_t anchor : {3u, 7u})
      for (const auto& [node, weight] : body.patches[anchor])
        EXPECT_TRUE(weight < 1e-8 ||
                    std::binary_search(body.anchors.begin(), body.anchors.end(), node));
  }
}

TEST(LatticeBody, EightyFacesGiveSomeHundreds) {
  const std::size_t count = make_lattice_body(sphere_mesh(50, 1), {}, 0).tetrahedra.size();
  EXPECT_GT(count, 200u);
  EXPECT_LT(count, 1000u);
}

TEST(LatticeBody, AnAnchorHoldsAllThatCarriesIt) {
  const TriangleMesh proxy = lumpy_mesh(50, 1);
  const TetrahedralBody body = make_lattice_body(proxy, {3, 17}, 0);
  for (const std::uint32_t a : {3u, 17u}) {
    const EmbeddedVertex& v = body.vertices[a];
    double held = 0;
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t node = body.tetrahedra[v.tetrahedron].nodes[k];
      if (std::binary_search(body.anchors.begin(), body.anchors.end(), node)) held += v.weights[k];
    }
    EXPECT_NEAR(held, 1, 1e-7);
  }
  EXPECT_LE(body.anchors.size(), 8u);
}

TEST(LatticeBody, FinerCellsHoldTheSameArea) {
  const TriangleMesh proxy = lumpy_mesh(50, 1);
  const Face& face = proxy.faces[5];
  const Eigen::Vector3d middle =
      (proxy.vertices[face[0]] + proxy.vertices[face[1]] + proxy.vertices[face[2]]) / 3;
  std::vector<std::uint32_t> anchors(face.begin(), face.end());
  std::sort(anchors.begin(), anchors.end());
  for (const double cell_mm : {12.0, 6.0, 4.0}) {
    const TetrahedralBody body = make_lattice_body(proxy, anchors, cell_mm);
    double nearest_mm = 1e9;
    for (const std::uint32_t n : body.anchors)
      nearest_mm = std::min(nearest_mm, (body.nodes_mm[n] - middle).norm());
    EXPECT_LT(nearest_mm, cell_mm) << cell_mm;  // and not at the corners alone
  }
}

TEST(LatticeBody, RefusesWhatHasNoInsideAndTooManyCells) {
  TriangleMesh open = sphere_mesh(50, 1);
  open.faces.pop_back();
  EXPECT_THROW(make_lattice_body(open, {}, 3), BadDataError);
  EXPECT_THROW(make_lattice_body(sphere_mesh(50, 1), {}, 0.01), UsageError);
}

// Two balls of opposite orientation, one in the other: a shell.
TEST(InsideSamples, CountsWindings) {
  TriangleMesh hole = sphere_mesh(5, 2);
  for (Face& f : hole.faces) std::swap(f[1], f[2]);
  const TriangleMesh shell = joined(sphere_mesh(10, 2), hole);
  const SampleGrid grid{{-12, 0, 0}, 4, {7, 1, 1}};
  EXPECT_EQ(inside_samples(shell, grid), (std::vector<std::uint8_t>{0, 1, 0, 0, 0, 1, 0}));
}

TEST(MakeMechanics, TetrahedraOnlyWhenAsked) {
  MechanicsOptions options;
  EXPECT_FALSE(make_mechanics(sphere_mesh(50, 1), options).body);
  options.fem = true;
  options.poisson_ratio = 0.3;
  const MechanicsModel model = make_mechanics(sphere_mesh(50, 1), options);
  ASSERT_TRUE(model.body);
  EXPECT_EQ(model.body->poisson_ratio, 0.3);
  EXPECT_FALSE(model.body->anchors.empty());
  const std::string text = mechanics_to_json(model);
  EXPECT_EQ(mechanics_to_json(mechanics_from_json(text, "m", 42)), text);
}

TEST(MakeMechanics, CellsInWhichNothingCouldMoveAreRefused) {
  MechanicsOptions options;
  options.fem = true;
  options.anchor_fraction = 0.9;
  options.fem_cell_mm = 200;  // one cell: its nodes all carry anchors
  EXPECT_THROW(make_mechanics(sphere_mesh(50, 1), options), UsageError);
  options.fem_cell_mm = 0.1;  // a billion cells
  EXPECT_THROW(make_mechanics(sphere_mesh(50, 1), options), UsageError);
  options.fem_cell_mm = 0;
  EXPECT_NO_THROW(make_mechanics(sphere_mesh(50, 1), options));
}

// What one viewpoint has seen of tissue: a hill on a plane of 60 × 60 mm, facing −z.
TriangleMesh hilly_sheet(int side = 20) {
  TriangleMesh sheet;
  for (int j = 0; j <= side; ++j) {
    for (int i = 0; i <= side; ++i) {
      const double x = 60.0 * i / side - 30, y = 60.0 * j / side - 30;
      sheet.vertices.emplace_back(x, y, 100 - 12 * std::exp(-(x * x + y * y) / 200));
      if (i == side || j == side) continue;
      const auto a = static_cast<std::uint32_t>(j * (side + 1) + i), b = a + side + 1;
      sheet.faces.push_back({a, b, a + 1});
      sheet.faces.push_back({b, b + 1, a + 1});
    }
  }
  return sheet;
}

// What tetrahedra lack of a tip's dent: the less the finer they are, and nothing for a tip as wide
// as they are coarse. It scales as a compliance does.
TEST(SkinGive, IsWhatTetrahedraLackOfATipsDent) {
  const TriangleMesh proxy = lumpy_mesh(50, 2);
  const auto mean_give = [&](double cell_share, double radius_mm, double young_modulus_kpa) {
    MechanicsOptions options;
    options.fem = true;
    options.fem_cell_mm = cell_share * mean_edge_length(proxy);
    options.instrument_radius_mm = radius_mm;
    options.young_modulus_kpa = young_modulus_kpa;
    const MechanicsModel model = make_mechanics(proxy, options);
    double sum = 0;
    for (const double give : model.body->give_mm_per_n) sum += give;
    for (const std::uint32_t anchor : model.anchors)
      EXPECT_EQ(model.body->give_mm_per_n[anchor], 0);
    return sum / double(proxy.vertices.size() - model.anchors.size());
  };
  const double give = mean_give(0.75, 3, 10);
  EXPECT_GT(give, 0);
  EXPECT_LT(give, (1 - 0.45 * 0.45) / (2 * 0.010 * 3)) << "less than the whole dent";
  EXPECT_LT(mean_give(0.5, 3, 10), 0.97 * give);
  EXPECT_LT(mean_give(0.75, 6, 10), 0.6 * give);
  EXPECT_NEAR(mean_give(0.75, 3, 20), give / 2, 1e-6 * give);
}

TEST(TissueLayer, IsClosedAndAsThickAsAsked) {
  const TriangleMesh sheet = hilly_sheet();
  ASSERT_TRUE(is_sheet(sheet));
  EXPECT_FALSE(is_sheet(lumpy_mesh(50, 2)));
  const TriangleMesh layer = tissue_layer(sheet, 15);
  EXPECT_NEAR(signed_volume(layer), 60 * 60 * 15, 1e-6);
  EXPECT_FALSE(is_sheet(layer));
}

TEST(MakeLatticeBody, OfASheetFillsTheLayerUnderIt) {
  const TriangleMesh sheet = hilly_sheet();
  MechanicsOptions options;
  options.fem = true;
  options.fem_cell_mm = 5;
  options.anchor_direction = {0, 0, 1};
  const MechanicsModel model = make_mechanics(sheet, options);
  const TetrahedralBody& body = *model.body;
  ASSERT_EQ(body.vertices.size(), sheet.vertices.size());
  // The shares are sampled, and what only vertices reach into counts for a twentieth.
  EXPECT_NEAR(tissue_volume(body), 60 * 60 * 15, 0.03 * 60 * 60 * 15);
  for (std::uint32_t v = 0; v < sheet.vertices.size(); ++v)
    ASSERT_LT((embedded(body, v) - sheet.vertices[v]).norm(), 1e-9);
  // Held below, and not where the hill is.
  double highest_held = 1e9;
  for (const std::uint32_t n : body.anchors)
    highest_held = std::min(highest_held, body.nodes_mm[n].z());
  EXPECT_GT(highest_held, 95);
  EXPECT_EQ(part_count(body), 1u);
}

TEST(MakeLatticeBody, AClosedSurfaceWithAHoleIsStillRefused) {
  TriangleMesh body = lumpy_mesh(50, 2);
  body.faces.pop_back();
  MechanicsOptions options;
  options.fem = true;
  options.fem_cell_mm = 4;
  EXPECT_THROW(make_mechanics(body, options), BadDataError);
}

}  // namespace
}  // namespace organbake
