// SPDX-License-Identifier: GPL-3.0-or-later
#include "color_flood.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

TEST(ColorFlood, KeepsKnownColoursAndFillsTheRestBetweenThem) {
  // A strip from red (left) to blue (right): between them the flood is a blend.
  const TriangleMesh mesh = square_at(Vector3d::Zero(), Vector3d::UnitZ(), 10, 10);
  const Vector3d across = (mesh.vertices[10] - mesh.vertices[0]).normalized();
  std::vector<char> known(mesh.vertices.size(), 0);
  std::vector<Vector3f> colors(mesh.vertices.size(), Vector3f(0, 9, 0));
  for (std::size_t v = 0; v < known.size(); ++v) {
    const double side = mesh.vertices[v].dot(across);
    if (std::abs(side) < 9.9) continue;
    known[v] = 1;
    colors[v] = side < 0 ? Vector3f(1, 0, 0) : Vector3f(0, 0, 1);
  }
  const std::vector<Vector3f> given = colors;
  flood_colors(mesh, known, colors);
  for (std::size_t v = 0; v < known.size(); ++v) {
    if (known[v]) {
      EXPECT_EQ(colors[v], given[v]);
    } else {
      EXPECT_EQ(colors[v].y(), 0) << "the colour of an unknown vertex must not be used";
      EXPECT_NEAR(colors[v].sum(), 1, 1e-5);
      const double along = mesh.vertices[v].dot(across) / 20 + 0.5;
      EXPECT_NEAR(colors[v].z(), along, 0.2);
    }
  }
}

TEST(ColorFlood, PiecesThatNobodySawTakeTheMean) {
  const TriangleMesh mesh = joined(sphere_mesh(5, 1), moved(sphere_mesh(5, 1), {50, 0, 0}));
  std::vector<char> known(mesh.vertices.size(), 0);
  std::vector<Vector3f> colors(mesh.vertices.size(), Vector3f::Zero());
  known[0] = known[1] = 1;
  colors[0] = {0.2f, 0, 0};
  colors[1] = {0.4f, 0, 0};
  flood_colors(mesh, known, colors);
  EXPECT_NEAR(colors.back().x(), 0.3, 1e-6);
  EXPECT_GE(colors[5].x(), 0.2f);
  EXPECT_LE(colors[5].x(), 0.4f);
}

TEST(ColorFlood, NothingKnownIsAnError) {
  const TriangleMesh mesh = sphere_mesh(5, 0);
  std::vector<Vector3f> colors(mesh.vertices.size(), Vector3f::Zero());
  EXPECT_THROW(flood_colors(mesh, std::vector<char>(mesh.vertices.size(), 0), colors),
               BadDataError);
}

}  // namespace
}  // namespace organbake
