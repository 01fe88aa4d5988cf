// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/repair/repair.h"

#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/error_message.h"
#include "support/meshes.h"
#include "support/testing.h"
#include "voxel_mesh.h"

namespace organbake {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

void expect_sound(const RepairSummary& repaired) {
  const MeshTopology topology = analyse_topology(repaired.mesh);
  EXPECT_TRUE(topology.closed_manifold());
  EXPECT_EQ(topology.unused_vertices, 0u);
  EXPECT_GT(signed_volume(repaired.mesh), 0);
}

constexpr double kExact = 1e-9;  // of a volume: the same corners, other sums

TEST(Repair, ASoundSurfaceComesBackAsItIs) {
  const TriangleMesh organ = lumpy_mesh(40, 4);
  const RepairSummary repaired = repair(organ, {});
  EXPECT_EQ(repaired.mesh.faces, organ.faces);
  EXPECT_EQ(repaired.mesh.vertices, organ.vertices);
  EXPECT_THAT(repaired.done, IsEmpty());
  EXPECT_NEAR(repaired.max_mm, 0, 1e-4);
}

TEST(Repair, ASurfaceInsideOutIsTurnedAndACavityKept) {
  TriangleMesh organ = lumpy_mesh(40, 3), hollow = sphere_mesh(20, 3);
  const double volume = signed_volume(organ) - signed_volume(hollow);
  for (Face& face : organ.faces) std::swap(face[0], face[1]);
  organ = joined(organ, hollow);  // outward, as a solid of its own
  const RepairSummary repaired = repair(organ, {});
  EXPECT_NEAR(signed_volume(repaired.mesh) / volume, 1, kExact);
  EXPECT_THAT(repaired.done, Contains(HasSubstr("1 piece that was wound inside out")));
  EXPECT_THAT(repaired.done, Contains(HasSubstr("as a cavity's wall")));
}

// Of two balls of this radius whose middles are as far apart: 2 V minus a lens of two caps, each
// half a radius high.
double two_balls_mm3(double radius_mm) {
  const double cap_mm = radius_mm / 2;
  return 2 * (4 * M_PI / 3 * std::pow(radius_mm, 3) -
              M_PI * cap_mm * cap_mm * (3 * radius_mm - cap_mm) / 3);
}
constexpr double kFacets = 0.005;  // of a ball of 5,120 faces

TEST(Repair, OverlappingPiecesBecomeTheirUnion) {
  const TriangleMesh ball = sphere_mesh(30, 4), other = moved(ball, {30, 0, 0});
  const double wanted_mm3 = two_balls_mm3(30);
  EXPECT_NEAR(wanted_mm3, 190'851.8, 0.1);
  for (const TriangleMesh& pair :
       {joined(ball, other), joined(inside_out(ball), other), joined(ball, inside_out(other)),
        inside_out(joined(other, ball))}) {
    const RepairSummary repaired = repair(pair, {});
    expect_sound(repaired);
    EXPECT_EQ(analyse_topology(repaired.mesh).components, 1u);
    EXPECT_FALSE(repaired.wrapped);
    EXPECT_NEAR(signed_volume(repaired.mesh) / wanted_mm3, 1, kFacets);
    EXPECT_LT(std::abs(repaired.volume_change), 1e-6) << "what they share never counted";
    EXPECT_THAT(repaired.done, Contains(HasSubstr("2 overlapping pieces united: 35.")));
  }
}

TEST(Repair, UnionsOfManyPiecesKeepColoursAndWhatLiesApart) {
  TriangleMesh chain, apart = moved(sphere_mesh(20, 3), {0, 200, 0});
  for (int i = 0; i < 5; ++i)
    chain = joined(std::move(chain), moved(sphere_mesh(30, 3), {40.0 * i, 3.0 * i, 0}));
  chain = joined(chain, moved(apart, {0, 0, 0}));
  for (const auto& v : chain.vertices) chain.colors.emplace_back(v.x() < 80 ? 1.f : 0.f, 0.f, 0.f);
  const RepairSummary repaired = repair(chain, {});
  expect_sound(repaired);
  EXPECT_EQ(analyse_topology(repaired.mesh).components, 2u);
  EXPECT_THAT(repaired.done, Contains(HasSubstr("5 overlapping pieces united")));
  ASSERT_EQ(repaired.mesh.colors.size(), repaired.mesh.vertices.size());
  constexpr double kEdge_mm = 8;  // of a ball of 1,280 faces
  for (std::size_t v = 0; v < repaired.mesh.vertices.size(); ++v) {
    const double x = repaired.mesh.vertices[v].x();
    if (std::abs(x - 80) > kEdge_mm) {
      EXPECT_EQ(repaired.mesh.colors[v].x(), x < 80 ? 1 : 0) << x;
    }
  }
}

TEST(Repair, APieceThatIsThereTwiceCountsOnce) {
  const TriangleMesh organ = lumpy_mesh(40, 3);
  const RepairSummary repaired = repair(joined(organ, organ), {});
  expect_sound(repaired);
  EXPECT_NEAR(signed_volume(repaired.mesh) / signed_volume(organ), 1, kExact);
}

TEST(Repair, BoxesWhoseSidesLieInOnePlaneAreUnited) {
  const TriangleMesh box = box_mesh({20, 10, 10});
  const RepairSummary repaired = repair(joined(box, moved(box, {15, 0, 0})), {});
  expect_sound(repaired);
  EXPECT_NEAR(signed_volume(repaired.mesh), 3500, 1e-6);
}

// Two boxes, of which the second lies so that they share nothing but points.
TEST(Repair, PiecesThatTouchAlongAnEdgeStayAsTheyAre) {
  const TriangleMesh box = box_mesh({50, 50, 50});
  TriangleMesh on_its_edge = box;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitX()).toRotationMatrix();
  for (auto& v : on_its_edge.vertices) v = turn * v;
  const std::pair<const char*, Eigen::Vector3d> places[] = {
      {"the whole edge", {50, 50, 0}},
      {"a part of it", {50, 50, 20}},
      {"a little of it", {50, 50, 49.9}},
      {"one point of two edges", {50, 50, 50}},
      {"where its edges' third lies", {50, -50, 50. / 3}}};
  for (const auto& [what, at] : places) {
    const TriangleMesh both = joined(box, moved(box, at));
    const RepairSummary repaired = repair(both, {});
    EXPECT_FALSE(repaired.wrapped) << what;
    EXPECT_EQ(repaired.mesh.faces, both.faces) << what;
    EXPECT_NEAR(signed_volume(repaired.mesh), 250000, 1e-6) << what;
  }
  TriangleMesh base = box_mesh({50, 90, 50});
  base = moved(base, {0, -45, -50});
  const RepairSummary standing = repair(joined(base, on_its_edge), {});
  EXPECT_FALSE(standing.wrapped) << "an edge within a face";
  EXPECT_NEAR(signed_volume(standing.mesh), 350000, 1e-6);
  const RepairSummary also =
      repair(joined(joined(box, moved(box, {50, 50, 20})), moved(box, {10, 20, -40})), {});
  EXPECT_FALSE(also.wrapped) << "two that touch, one that overlaps the first";
  EXPECT_NEAR(signed_volume(also.mesh), 375000 - 40. * 30 * 10, 1e-3);
}

TEST(Repair, PiecesThatCrossThemselvesTooAreWrapped) {
  // A ball of which a patch is pushed out through the other side.
  TriangleMesh crossing = sphere_mesh(30, 3);
  for (auto& v : crossing.vertices)
    if (v.x() < -22) v.x() += 80;
  const RepairSummary repaired = repair(joined(crossing, moved(sphere_mesh(30, 3), {40, 0, 0})),
                                        {.wrap_mm = 6, .volume_change = 1});
  expect_sound(repaired);
  EXPECT_TRUE(repaired.wrapped);
  EXPECT_THAT(repaired.done, Contains(HasSubstr("overlap and cross themselves")));
}

TEST(Repair, AVolumeThatChangesIsSaidAndTooMuchIsRefused) {
  const TriangleMesh organ =
      joined(lumpy_mesh(40, 3), moved(lumpy_mesh(20, 3), {100, 0, 0}));  // 8 to 1
  std::string said;
  const RunContext context(
      [&](LogLevel level, std::string_view text) {
        if (level == LogLevel::warning) said += text;
      },
      {}, nullptr);
  EXPECT_THAT(
      message_of(ExitCode::bad_data, [&] { repair(organ, {.island_share = 0.5}, context); }),
      HasSubstr("the volume changes by -11.1 %"));
  const RepairSummary allowed = repair(organ, {.island_share = 0.5, .volume_change = 0.2}, context);
  EXPECT_NEAR(allowed.volume_change, -1.0 / 9, 1e-9);
  EXPECT_THAT(said, HasSubstr("-11.1 %"));
  said.clear();
  repair(organ, {}, context);
  EXPECT_EQ(said, "");
}

TEST(Repair, AnOrganInsideOutWithAHoleIsTurnedToo) {
  TriangleMesh organ = inside_out(sphere_mesh(40, 4));
  const double volume = -signed_volume(organ);
  organ.faces.resize(organ.faces.size() - 4);
  const RepairSummary repaired = repair(organ, {});
  expect_sound(repaired);
  EXPECT_NEAR(signed_volume(repaired.mesh) / volume, 1, 0.002);
}

TEST(Repair, IslandsAreDroppedAndPiecesOfTheOrganAreNot) {
  TriangleMesh organ = lumpy_mesh(40, 3);
  const double volume = signed_volume(organ) + signed_volume(lumpy_mesh(20, 3));
  organ = joined(organ, moved(lumpy_mesh(20, 3), {100, 0, 0}));
  organ = joined(organ, moved(sphere_mesh(0.5, 1), {900, 0, 0}));
  organ = joined(organ, moved(sphere_mesh(2, 1), {-80, 0, 0}));
  const RepairSummary repaired = repair(organ, {});
  expect_sound(repaired);
  EXPECT_NEAR(signed_volume(repaired.mesh) / volume, 1, kExact);
  EXPECT_THAT(repaired.done, Contains("2 islands dropped"));
  EXPECT_EQ(analyse_topology(repair(organ, {.island_share = 0}).mesh).components, 4u);
}

// Each step takes as long as there are faces, not the square of the pieces.
TEST(Repair, ThousandsOfPiecesAreNoMatter) {
  TriangleMesh many = box_mesh({100, 100, 100});
  const TriangleMesh one = tetrahedron_mesh();
  std::size_t inside_out_ones = 0;
  for (int i = 0; i < 20'000; ++i) {
    // In rows beside the box, and within it, where they are the walls of cavities.
    const Eigen::Vector3d at(3.0 * (i % 20), 3.0 * (i / 20 % 20), 5 + 1.5 * (i / 400));
    const bool within = i % 2 == 0;
    inside_out_ones += !within && i % 3 == 0;
    const Eigen::Vector3d beside(within ? 5 : 200, 5, 0);
    TriangleMesh piece = moved(one, at + beside);
    if (within || i % 3 == 0) piece = inside_out(std::move(piece));
    many = joined(std::move(many), piece);
  }
  const RepairSummary repaired = repair(many, {.island_share = 0});
  EXPECT_EQ(analyse_topology(repaired.mesh).components, 20'001u);
  EXPECT_THAT(repaired.done, Contains(std::to_string(inside_out_ones) +
                                      " pieces that were wound inside out turned outward"));
  EXPECT_THAT(repair(many, {}).done, Contains("20000 islands dropped"));
}

TEST(Repair, SmallHolesAreClosedAndAnOpenSurfaceStaysOpen) {
  TriangleMesh organ = sphere_mesh(40, 4);
  const double volume = signed_volume(organ);
  std::vector<Face> kept;
  for (const Face& face : organ.faces) {
    // A cap 4 mm wide round the pole goes, and a single face far from it.
    const bool cap = has_corner(face, 0);
    if (!cap && &face != &organ.faces[777]) kept.push_back(face);
  }
  organ.faces = kept;
  const RepairSummary repaired = repair(organ, {});
  expect_sound(repaired);
  EXPECT_NEAR(signed_volume(repaired.mesh) / volume, 1, 0.002) << "flat lids on a round organ";
  EXPECT_THAT(repaired.done, Contains("2 holes closed"));

  TriangleMesh half = sphere_mesh(40, 4);
  std::erase_if(half.faces, [&](const Face& face) { return half.vertices[face[0]].z() < 0; });
  const RepairSummary open = repair(half, {});
  EXPECT_EQ(open.open_loops, 1u);
  EXPECT_FALSE(open.wrapped);
  EXPECT_EQ(open.mesh.faces.size(), half.faces.size());
}

// A ball of 30 mm with a round hole at its top, whose rim has an even number of corners: the
// furthest two lie across the whole hole.
TriangleMesh bladder_with_hole(double width_mm) {
  constexpr double kRadius_mm = 30;
  constexpr int kRings = 40;
  const double rim = std::acos(width_mm / 2 / kRadius_mm);
  std::vector<Eigen::Vector2d> outline = {{0, -kRadius_mm}};
  for (int i = 1; i <= kRings; ++i) {
    const double latitude = -M_PI / 2 + (rim + M_PI / 2) * i / kRings;
    outline.emplace_back(kRadius_mm * std::cos(latitude), kRadius_mm * std::sin(latitude));
  }
  outline.emplace_back(0, kRadius_mm * std::sin(rim));
  TriangleMesh mesh = revolved_mesh(outline, 48);
  std::erase_if(mesh.faces, [&](const Face& face) {
    return std::any_of(face.begin(), face.end(), [&](std::uint32_t v) {
      return mesh.vertices[v].z() > 0 && mesh.vertices[v].head<2>().norm() < 1e-9;
    });
  });
  return mesh;
}

TEST(Repair, AHoleIsAsWideAsItsFurthestTwoPointsLieApart) {
  const TriangleMesh whole = bladder_with_hole(9);
  EXPECT_NEAR(bounds(whole).diagonal() / 10, 10.4, 0.05) << "the usual limit";
  for (const double width_mm : {8.6, 9.8, 10.3}) {
    const RepairSummary closed = repair(bladder_with_hole(width_mm), {});
    EXPECT_EQ(closed.open_loops, 0u) << width_mm << " mm";
    expect_sound(closed);
  }
  EXPECT_EQ(repair(bladder_with_hole(10.6), {}).open_loops, 1u);
  for (const double limit_mm : {13.5, 18.0, 25.0}) {
    EXPECT_EQ(repair(bladder_with_hole(limit_mm - 0.1), {.hole_mm = limit_mm}).open_loops, 0u);
    const RepairSummary open = repair(bladder_with_hole(limit_mm + 0.1), {.hole_mm = limit_mm});
    EXPECT_EQ(open.open_loops, 1u) << limit_mm;
    EXPECT_THAT(open.done, Contains("1 hole wider than " + to_text(limit_mm, 1) + " mm left open"));
  }
}

TEST(Repair, ManyTunnelsAreClosedByAWrapThatStaysNear) {
  // A plate of 42 × 42 × 10 mm with 16 tunnels of 2 × 2 mm.
  const auto inside = [](int x, int y, int z) { return z < 5 && !(x % 5 == 3 && y % 5 == 3); };
  const TriangleMesh plate = voxel_mesh(21, 2, inside);
  const double solid_mm3 = 42.0 * 42 * 10;
  const RepairSummary repaired = repair(plate, {.wrap_mm = 4});
  expect_sound(repaired);
  EXPECT_TRUE(repaired.wrapped);
  EXPECT_EQ(repaired.genus, 0);
  EXPECT_NEAR(signed_volume(repaired.mesh) / solid_mm3, 1, 0.02) << "lids sag into the tunnels";
  EXPECT_THAT(repaired.done, Contains(HasSubstr("16 tunnels were closed by a wrap of 4.00 mm")));
  EXPECT_EQ(repair(plate, {.most_tunnels = 16}).genus, 16) << "kept when they are wanted";
}

TEST(Repair, NoFacesCannotBeRepaired) {
  EXPECT_THAT(message_of(ExitCode::bad_data, [] { repair(TriangleMesh(), {}); }),
              HasSubstr("no faces"));
}

}  // namespace
}  // namespace organbake
