// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "organbake/capture/skin_bake.h"
#include "organbake/core/text.h"
#include "organbake/decimate/decimate.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/phantom/phantom.h"
#include "promises.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kRadius_mm = 5, kNear_mm = 40;
constexpr int kMoving = 80, kHeld = 50;  // steps

enum class Touch { poke, grab };

// The phantom as it is baked, its tetrahedra coarse and four times as many.
struct TouchedOrgan {
  TriangleMesh proxy;
  SmoothSkin skin;
  std::vector<Face> skin_faces;
  MechanicsModel coarse, fine;

  TouchedOrgan() {
    const TriangleMesh surface = OrganPhantom({}).surface(5);
    proxy = decimate(surface, {.faces = 480}).proxy;
    skin = bake_smooth_skin(surface, proxy, 6);
    skin_faces = smooth_skin_faces(proxy, skin.steps);
    MechanicsOptions options;
    options.fem = true;
    options.grasp_slip_n = 0;
    options.fem_cell_mm = 0.75 * mean_edge_length(proxy);
    coarse = make_mechanics(proxy, options);
    options.fem_cell_mm /= std::cbrt(4.0);
    fine = make_mechanics(proxy, options);
  }

  // Where the skin's nodes lie once a tip has come from outside and stays.
  std::vector<Vector3d> touched(const MechanicsModel& mechanics, Touch touch, const Vector3d& site,
                                const Vector3d& out, Vector3d& tip_mm) const {
    const double way_mm = touch == Touch::poke ? kRadius_mm - 15 : 40,
                 from_mm = touch == Touch::poke ? kRadius_mm : 0;
    DeformOptions options;
    options.solver = TissueSolver::fem;
    Deformer deformer(DeformBodies{{proxy, mechanics, {}, &skin}}, options);
    Instrument tip;
    tip.active = true;
    tip.radius_mm = kRadius_mm;
    if (touch == Touch::grab) tip.kind = Grasper{};
    for (int i = 0; i <= kMoving + kHeld; ++i) {
      const double share = std::min(1.0, double(i) / kMoving);
      tip.position_mm = site + (from_mm + share * (way_mm - from_mm)) * out;
      deformer.step({tip});
    }
    tip_mm = tip.position_mm;
    std::vector<Vector3d> nodes;
    carry(skin, deformer.positions(), nodes);
    return nodes;
  }
};

// An edge of the skin, and the corner beside it on either side.
std::vector<std::array<std::uint32_t, 4>> hinges_of(const TouchedOrgan& organ, std::size_t nodes) {
  const TriangleMesh mesh{std::vector<Vector3d>(nodes, Vector3d::Zero()), organ.skin_faces, {}};
  std::vector<std::array<std::uint32_t, 4>> hinges;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() != 2) return;
    const auto across = [&](const EdgeUse& use) {
      return mesh.faces[use.face()][use.opposite_corner() % 3];
    };
    hinges.push_back({uses[0].low, uses[0].high, across(uses[0]), across(uses[1])});
  });
  return hinges;
}

double fold_deg(const std::vector<Vector3d>& at, const std::array<std::uint32_t, 4>& hinge) {
  const Vector3d along = at[hinge[1]] - at[hinge[0]];
  const Vector3d one = along.cross(at[hinge[2]] - at[hinge[0]]),
                 other = (at[hinge[3]] - at[hinge[0]]).cross(along);
  return std::atan2(one.cross(other).norm(), one.dot(other)) * 180 / std::numbers::pi;
}

// By how much the coarse tissue's skin is folded more than the fine one's within reach of the tip:
// 99 of 100 edges by no more. Vertices follow their patches, or as they did without these.
double folds_beyond_deg(TouchedOrgan organ, Touch touch, bool with_patches) {
  for (MechanicsModel* mechanics : {&organ.coarse, &organ.fine})
    if (!with_patches) mechanics->body->patches.clear();
  const std::vector<Vector3d> normals = vertex_normals(organ.proxy);
  const Vector3d middle = bounds(organ.proxy).center();
  std::vector<double> beyond;
  for (const Vector3d& towards : {Vector3d(0.2, -1, 0.3), Vector3d(-0.3, -1, 0.1)}) {
    const auto cosine = [&](const Vector3d& v) {
      return (v - middle).normalized().dot(towards.normalized());
    };
    const auto& all = organ.proxy.vertices;
    const auto site = std::max_element(
        all.begin(), all.end(),
        [&](const Vector3d& a, const Vector3d& b) { return cosine(a) < cosine(b); });
    const Vector3d out = normals[static_cast<std::size_t>(site - all.begin())];
    Vector3d tip_mm;
    const auto coarse = organ.touched(organ.coarse, touch, *site, out, tip_mm),
               fine = organ.touched(organ.fine, touch, *site, out, tip_mm);
    for (const auto& hinge : hinges_of(organ, coarse.size()))
      if ((0.5 * (coarse[hinge[0]] + coarse[hinge[1]]) - tip_mm).norm() < kNear_mm)
        beyond.push_back(fold_deg(coarse, hinge) - fold_deg(fine, hinge));
  }
  EXPECT_GT(beyond.size(), 500u);
  const auto high = beyond.begin() + std::ptrdiff_t(beyond.size() * 99 / 100);
  std::nth_element(beyond.begin(), high, beyond.end());
  return *high;
}

TEST(TissueBends, AsFourTimesAsManyTetrahedraDo) {
  const TouchedOrgan organ;
  ASSERT_GT(organ.fine.body->tetrahedra.size(), 3 * organ.coarse.body->tetrahedra.size());
  const std::string what = ": folds of the skin beyond those of finer tetrahedra, 99th percentile";
  for (const bool with_patches : {false, true}) {
    report(
        "a poke of 15 mm, vertices as " + std::string(with_patches ? "patches" : "points") + what,
        "degrees", folds_beyond_deg(organ, Touch::poke, with_patches));
  }
  // What a grasper carries pulls at points without patches.
  const double points = folds_beyond_deg(organ, Touch::grab, false);
  report("a grab of 40 mm, vertices as points" + what, "degrees", points);
  expect({"a grab of 40 mm, vertices as patches" + what, "degrees",
          folds_beyond_deg(organ, Touch::grab, true), 0.75 * points});
}

}  // namespace
}  // namespace organbake
