// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/decimate/decimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "support/meshes.h"

namespace organbake {
namespace {

TEST(FacesForTool, GiveEdgesOfThreeRadii) {
  const TriangleMesh surface = sphere_mesh(60, 5);
  for (const double radius_mm : {4.0, 7.0}) {
    DecimateOptions options;
    options.faces = faces_for_tool(surface, radius_mm);
    constexpr double kNearly = 0.1;  // faces are not all equilateral
    EXPECT_NEAR(mean_edge_length(decimate(surface, options).proxy) / (3 * radius_mm), 1, kNearly);
  }
}

TEST(FacesForTool, AreNeitherFewerThanThePapersNorMoreThanAFrameBears) {
  EXPECT_EQ(faces_for_tool(sphere_mesh(10, 4), 50), 80u);
  EXPECT_EQ(faces_for_tool(sphere_mesh(300, 4), 1), 1500u);
}

TEST(FacesForTool, NeedAToolOfSomeSize) {
  const TriangleMesh surface = sphere_mesh(40, 3);
  for (const double radius_mm : {0.0, -5.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(faces_for_tool(surface, radius_mm), UsageError);
}

}  // namespace
}  // namespace organbake
