// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimmed_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <span>

#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

constexpr int kSide = 41;  // vertices, and voxels, 1 mm apart

// A sheet of squares where `covered`, in a volume whose weights are as `weight` has them.
struct Sheet {
  TriangleMesh mesh;
  DistanceVolume volume;

  Sheet(const std::function<bool(int, int)>& covered,
        const std::function<float(int, int)>& weight) {
    volume.box = {Eigen::Vector3d::Zero(), 1, {kSide, kSide, 1}};
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        mesh.vertices.emplace_back(x, y, 0);
        volume.weight.push_back(weight(x, y));
      }
    const auto at = [](int x, int y) { return static_cast<std::uint32_t>(y * kSide + x); };
    for (int y = 0; y + 1 < kSide; ++y)
      for (int x = 0; x + 1 < kSide; ++x)
        if (covered(x, y)) {
          mesh.faces.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
          mesh.faces.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
        }
  }
};

double border_length(const TriangleMesh& mesh) {
  double length = 0;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 1)
      length += (mesh.vertices[uses[0].low] - mesh.vertices[uses[0].high]).norm();
  });
  return length;
}

TEST(TrimmedSurface, CutsOffWhatIsPoorlySeen) {
  const Sheet sheet([](int, int) { return true; }, [](int x, int) { return x < 30 ? 1.F : 0.02F; });
  const TriangleMesh trimmed = trimmed_surface(sheet.mesh, sheet.volume, 0.25);
  // Weights are spread by a few voxels.
  EXPECT_NEAR(surface_area(trimmed), 30 * 40, 3.5 * 40);
  for (const Face& face : trimmed.faces)
    for (const std::uint32_t corner : face) EXPECT_LT(trimmed.vertices[corner].x(), 34);
}

TEST(TrimmedSurface, LeavesWhatIsPoorlySeenInside) {
  const Sheet sheet([](int, int) { return true; },
                    [](int x, int y) { return std::hypot(x - 20, y - 20) < 5 ? 0.02F : 1.F; });
  const TriangleMesh trimmed = trimmed_surface(sheet.mesh, sheet.volume, 0.25);
  EXPECT_EQ(analyse_topology(largest_components(trimmed, 1)).euler_characteristic, 1);
}

TEST(TrimmedSurface, RoundsTheStepsOfABorder) {
  const auto disc = [](int x, int y) { return std::hypot(x - 19.5, y - 19.5) < 15; };
  const Sheet sheet(disc, [](int, int) { return 1.F; });
  const TriangleMesh trimmed = trimmed_surface(sheet.mesh, sheet.volume, 0.25);
  // Steps make a circle's border 4/π times as long; what hangs on by a corner goes, too.
  EXPECT_GT(border_length(sheet.mesh), 1.2 * 2 * M_PI * 15);
  EXPECT_LT(border_length(trimmed), 1.06 * 2 * M_PI * 15);
  EXPECT_GT(surface_area(trimmed), 0.93 * M_PI * 15 * 15);
}

}  // namespace
}  // namespace organbake
