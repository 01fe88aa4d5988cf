// SPDX-License-Identifier: Apache-2.0
#include "organbake/warp/rasteriser.h"

#include <gtest/gtest.h>

#include <vector>

#include "organbake/core/random.h"

namespace organbake {
namespace {

constexpr PixelBox kPicture{0, 0, 64, 64};

TEST(Rasterise, CoversItsAreaInPixels) {
  int pixels = 0;
  rasterise(SnappedTriangle({RasterCorner{8, 8, 1}, {40, 8, 1}, {8, 40, 1}}), kPicture,
            [&](int, int, double, const auto&) { ++pixels; });
  EXPECT_NEAR(pixels, 32 * 32 / 2, 32);  // centres on the diagonal go to one side
}

TEST(Rasterise, SharedEdgesAreDrawnOnce) {
  // A fan of triangles round a point, whatever way each winds: every pixel exactly once.
  RandomStream random(4);
  for (int round = 0; round < 50; ++round) {
    std::vector<int> count(64 * 64, 0);
    const RasterCorner middle{random.uniform(20, 44), random.uniform(20, 44), 1};
    const RasterCorner rim[] = {{2, 2, 1},   {random.uniform(10, 50), 1, 1},  {62, 3, 1},
                                {61, 60, 1}, {random.uniform(10, 50), 62, 1}, {3, 61, 1}};
    for (int i = 0; i < 6; ++i) {
      std::array<RasterCorner, 3> t = {middle, rim[i], rim[(i + 1) % 6]};
      if (i % 2) std::swap(t[1], t[2]);
      rasterise(SnappedTriangle(t), kPicture,
                [&](int x, int y, double, const auto&) { ++count[y * 64 + x]; });
    }
    for (const int n : count) ASSERT_LE(n, 1);
    for (int y = 5; y < 58; ++y) {
      for (int x = 5; x < 58; ++x) ASSERT_EQ(count[y * 64 + x], 1) << x << "," << y;
    }
  }
}

TEST(Rasterise, WeightsAreCorrectInPerspective) {
  // Depths 100, 200, 400 at the corners: at a pixel, 1/z is linear.
  const std::array<RasterCorner, 3> t = {
      RasterCorner{4, 4, 1 / 100.0}, {60, 4, 1 / 200.0}, {4, 60, 1 / 400.0}};
  rasterise(SnappedTriangle(t), kPicture,
            [&](int x, int y, double depth, const std::array<double, 3>& w) {
              const double u = (x + 0.5 - 4) / 56, v = (y + 0.5 - 4) / 56;
              const double inverse = (1 - u - v) / 100 + u / 200 + v / 400;
              // The rule for shared edges moves an edge by 1/256² of a pixel.
              EXPECT_NEAR(depth * inverse, 1, 1e-7);
              EXPECT_NEAR(w[0] * 100 + w[1] * 200 + w[2] * 400, depth, 1e-9 * depth);
            });
}

TEST(Rasterise, StaysInItsWindow) {
  rasterise(SnappedTriangle({RasterCorner{-500, -400, 1}, {900, -300, 1}, {30, 800, 1}}), kPicture,
            [&](int x, int y, double, const auto&) {
              ASSERT_TRUE(x >= 0 && y >= 0 && x < 64 && y < 64);
            });
  const double huge = 1e12;
  rasterise(SnappedTriangle({RasterCorner{-huge, 0, 1}, {huge, 0, 1}, {0, huge, 1}}), kPicture,
            [&](int, int, double, const auto&) { FAIL(); });  // beyond reach: the clipper's to cut
}

}  // namespace
}  // namespace organbake
