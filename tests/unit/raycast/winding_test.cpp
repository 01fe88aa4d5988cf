// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/raycast/winding.h"

#include <gmock/gmock.h>

#include <cmath>

#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"

namespace organbake {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kExact = 1e-9;  // of a volume: the same corners, other sums

// The volume after turning, as a share of what is right.
double turned_share(TriangleMesh mesh, double right_mm3) {
  turn_outward(mesh);
  return signed_volume(mesh) / right_mm3;
}

TEST(TurnOutward, WhatIsRightStaysAsItIs) {
  const TriangleMesh organ = joined(lumpy_mesh(40, 3), moved(lumpy_mesh(20, 2), {100, 0, 0}));
  TriangleMesh same = organ;
  EXPECT_THAT(turn_outward(same).sentences(), IsEmpty());
  EXPECT_EQ(same.faces, organ.faces);
}

TEST(TurnOutward, WhatIsWoundInwardIsTurned) {
  const TriangleMesh organ = lumpy_mesh(40, 3), other = moved(lumpy_mesh(20, 2), {100, 0, 0});
  TriangleMesh inward = inside_out(organ);
  EXPECT_THAT(turn_outward(inward).sentences(), ElementsAre(HasSubstr("1 piece that was wound")));
  EXPECT_EQ(signed_volume(inward), signed_volume(organ));
  const double both = signed_volume(organ) + signed_volume(other);
  EXPECT_NEAR(turned_share(joined(organ, inside_out(other)), both), 1, kExact);
  EXPECT_NEAR(turned_share(joined(inside_out(organ), other), both), 1, kExact);
  EXPECT_NEAR(turned_share(inside_out(joined(organ, other)), both), 1, kExact);
}

TEST(TurnOutward, FacesWoundAtRandomAreWoundAlikeFirst) {
  TriangleMesh organ = lumpy_mesh(40, 3);
  const double volume = signed_volume(organ);
  std::size_t swapped = 0;
  for (std::size_t f = 0; f < organ.faces.size(); f += 3, ++swapped)
    std::swap(organ.faces[f][0], organ.faces[f][1]);
  EXPECT_EQ(turn_outward(organ).faces, swapped);
  EXPECT_EQ(analyse_topology(organ).misoriented_edges, 0u);
  EXPECT_NEAR(signed_volume(organ) / volume, 1, kExact);
}

TEST(TurnOutward, APieceWithinAnotherIsTheWallOfACavity) {
  const TriangleMesh organ = lumpy_mesh(40, 3), hollow = sphere_mesh(20, 2),
                     core = sphere_mesh(5, 1);
  const double volume = signed_volume(organ) - signed_volume(hollow);
  for (const TriangleMesh& outer : {organ, inside_out(organ)})
    for (const TriangleMesh& inner : {hollow, inside_out(hollow)}) {
      EXPECT_NEAR(turned_share(joined(outer, inner), volume), 1, kExact);
      EXPECT_NEAR(turned_share(joined(joined(inside_out(core), inner), outer),
                               volume + signed_volume(core)),
                  1, kExact);
    }
}

// Of the smaller ball nine tenths of the way lie inside the larger one, its first corner as well.
TEST(TurnOutward, APieceThatCrossesAnotherIsASolid) {
  const TriangleMesh large = sphere_mesh(30, 3), small = sphere_mesh(15, 3);
  for (const Eigen::Vector3d& by : {Eigen::Vector3d(24, 0, 0), Eigen::Vector3d(-24, 0, 0),
                                    Eigen::Vector3d(0, 21, 8), Eigen::Vector3d(5, -8, 22)}) {
    const double sum = signed_volume(large) + signed_volume(small);
    EXPECT_NEAR(turned_share(joined(large, moved(small, by)), sum), 1, kExact);
    EXPECT_NEAR(turned_share(joined(inside_out(large), inside_out(moved(small, by))), sum), 1,
                kExact);
  }
}

TEST(TurnOutward, ASmallHoleDoesNotHideWhichSideIsOut) {
  TriangleMesh organ = inside_out(lumpy_mesh(40, 3));
  organ.faces.resize(organ.faces.size() - 12);
  EXPECT_EQ(turn_outward(organ).outward, 1u);
  EXPECT_GT(signed_volume(organ), 0);
}

TEST(TurnOutward, AnOpenSheetKeepsTheSideThatItShows) {
  for (const TriangleMesh& sheet :
       {cut_in_half(sphere_mesh(40, 3), {0, 0, 1}, 25), cut_in_half(lumpy_mesh(40, 3), {1, 0, 0})})
    for (TriangleMesh side : {sheet, inside_out(sheet)}) {
      const std::vector<Face> before = side.faces;
      EXPECT_THAT(turn_outward(side).sentences(), IsEmpty());
      EXPECT_EQ(side.faces, before);
    }
}

TEST(PiecesOf, KnowTheirVolumeAndWhetherTheyAreClosed) {
  const auto pieces =
      pieces_of(joined(box_mesh({2, 3, 4}), cut_in_half(sphere_mesh(40, 4), {0, 0, 1})));
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_TRUE(pieces[0].closed);
  EXPECT_NEAR(pieces[0].volume_mm3, 24, kExact);
  EXPECT_NEAR(pieces[0].area_mm2, 52, kExact);
  EXPECT_NEAR(pieces[0].open_share, 0, kExact);
  EXPECT_FALSE(pieces[1].closed);
  constexpr double kFacets = 0.03;
  EXPECT_NEAR(pieces[1].open_share, 0.5, kFacets) << "a half ball's rim against its face";
}

}  // namespace
}  // namespace organbake
