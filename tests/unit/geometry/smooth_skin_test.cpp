// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/smooth_skin.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/geometry/lattice.h"
#include "organbake/geometry/shell_surface.h"
#include "support/meshes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kRounding_mm = 1e-12;  // of sums of three products, on bodies of 40 mm

TEST(SmoothSkin, FacesOfAProxyFaceFollowOneAnotherAndCoverIt) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  for (const std::uint32_t steps : {1u, 2u, 5u}) {
    const TriangleMesh skin = smooth_skin_mesh(proxy, flat_skin(proxy, steps));
    const std::size_t cells = std::size_t(steps) * steps;
    ASSERT_EQ(skin.faces.size(), proxy.faces.size() * cells);
    for (std::size_t f = 0; f < skin.faces.size(); ++f) {
      const auto [a, b, c] = skin.faces[f];
      const auto [p, q, r] = proxy.faces[f / cells];
      const Vector3d whole =
          (proxy.vertices[q] - proxy.vertices[p]).cross(proxy.vertices[r] - proxy.vertices[p]);
      const Vector3d part =
          (skin.vertices[b] - skin.vertices[a]).cross(skin.vertices[c] - skin.vertices[a]);
      EXPECT_LT((part * double(cells) - whole).norm(), 1e-9 * whole.norm())
          << "an equal share, turned as its face is";
    }
  }
}

TEST(SmoothSkin, CompletedWeightsSumToOne) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  SmoothSkin skin = flat_skin(proxy, 3);
  for (double& w : skin.weight) w = static_cast<float>(w);
  complete_weights(skin);
  for (std::size_t n = 0; n < skin.node_count(); ++n) {
    double sum = 0;
    for (std::uint32_t k = skin.first[n]; k < skin.first[n + 1]; ++k) sum += skin.weight[k];
    EXPECT_NEAR(sum, 1, 4 * std::numeric_limits<double>::epsilon());
  }
}

TEST(SmoothSkin, WrongOnesAreRefused) {
  const TriangleMesh proxy = tetrahedron_mesh();
  const SmoothSkin good = flat_skin(proxy, 2);
  EXPECT_NO_THROW(check_smooth_skin(good, proxy, "skin"));
  const auto refused = [&](auto change) {
    SmoothSkin bad = good;
    change(bad);
    EXPECT_THROW(check_smooth_skin(bad, proxy, "skin"), BadDataError);
  };
  refused([](SmoothSkin& s) { s.steps = 3; });
  refused([](SmoothSkin& s) { s.steps = 0; });
  refused([](SmoothSkin& s) { s.carrier[4] = 4; });
  refused([](SmoothSkin& s) { s.weight[0] = std::numeric_limits<double>::quiet_NaN(); });
  refused([](SmoothSkin& s) { s.weight[0] += 0.01; });
  refused([](SmoothSkin& s) { s.weight[0] = 1e6, s.weight[1] = 1 - 1e6; });
  refused([](SmoothSkin& s) { s.first.back() -= 1; });
  refused([](SmoothSkin& s) { s.first[1] = s.first[0]; });
}

TEST(ShellSurface, WithoutASkinItIsTheProxy) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  const ShellSurface shell(proxy);
  EXPECT_EQ(shell.faces_per_proxy_face(), 1u);
  EXPECT_EQ(shell.at_rest().faces, proxy.faces);
  EXPECT_EQ(shell.posed(proxy.vertices).vertices, proxy.vertices);
}

TEST(ShellSurface, MovesAsTheSkinIsCarried) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  const ShellSurface shell(proxy, flat_skin(proxy, 4));
  EXPECT_EQ(shell.faces_per_proxy_face(), 16u);
  const auto affine = [](const Vector3d& p) -> Vector3d {
    return {1 + p.x() + 0.5 * p.y(), 3 - 0.2 * p.z() + p.y(), 2 * p.z()};
  };
  std::vector<Vector3d> moved = proxy.vertices;
  for (Vector3d& v : moved) v = affine(v);
  const TriangleMesh posed = shell.posed(moved);
  for (std::size_t n = 0; n < posed.vertices.size(); ++n)
    EXPECT_LT((posed.vertices[n] - affine(shell.at_rest().vertices[n])).norm(), kRounding_mm * 100);
}

}  // namespace
}  // namespace organbake
