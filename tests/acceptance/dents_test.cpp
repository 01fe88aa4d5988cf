// SPDX-License-Identifier: GPL-3.0-or-later

#include "organbake/capture/capture.h"
#include "organbake/core/random.h"
#include "organbake/decimate/decimate.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/phantom/phantom.h"
#include "promises.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kRadius_mm = 5, kNear_mm = 40;
constexpr int kMoving = 80, kHeld = 50;  // steps

enum class Touch { poke, grab };

// The phantom with a proxy of so many faces.
struct TouchedOrgan {
  TriangleMesh proxy;
  SmoothSkin skin;

  explicit TouchedOrgan(const TriangleMesh& surface, std::size_t faces)
      : proxy(decimate(surface, {.faces = faces}).proxy),
        skin(bake_smooth_skin(surface, proxy, 6)) {}

  MechanicsModel mechanics(double cell_mm, double anchor_fraction = 0.15) const {
    MechanicsOptions options;
    options.fem = true;
    options.anchor_fraction = anchor_fraction;
    options.grasp_slip_n = 0;
    options.fem_cell_mm = cell_mm;
    return make_mechanics(proxy, options);
  }

  // The same by a proxy that is as good: its vertices lie elsewhere along it, by at most so far.
  TouchedOrgan aside(double most_mm, std::uint64_t seed) const {
    TouchedOrgan moved = *this;
    RandomStream random(seed);
    const std::vector<Vector3d> normals = vertex_normals(proxy);
    for (std::size_t v = 0; v < normals.size(); ++v) {
      const Vector3d one = normals[v].unitOrthogonal(), other = normals[v].cross(one);
      const double angle = random.uniform(0, 2 * std::numbers::pi);
      moved.proxy.vertices[v] +=
          random.uniform(0, most_mm) * (std::cos(angle) * one + std::sin(angle) * other);
    }
    return moved;
  }

  struct Touched {
    std::vector<Vector3d> nodes;  // of the skin
    Vector3d tip_mm;
    double force_n;
  };
  // Once a tip has come from outside and stays.
  Touched touched(const MechanicsModel& mechanics, Touch touch, const Vector3d& site,
                  const Vector3d& out) const {
    const double way_mm = touch == Touch::poke ? kRadius_mm - 15 : 40,
                 from_mm = touch == Touch::poke ? kRadius_mm : 0;
    DeformOptions options;
    options.solver = TissueSolver::fem;
    Deformer deformer(DeformBodies{{proxy, mechanics, {}, &skin}}, options);
    Instrument tip;
    tip.active = true;
    tip.radius_mm = kRadius_mm;
    if (touch == Touch::grab) tip.kind = Grasper{};
    double force_n = 0;
    for (int i = 0; i <= kMoving + kHeld; ++i) {
      const double share = std::min(1.0, double(i) / kMoving);
      tip.position_mm = site + (from_mm + share * (way_mm - from_mm)) * out;
      force_n = deformer.step({tip}).tip_force_n[0].norm();
    }
    Touched touched{{}, tip.position_mm, force_n};
    carry(skin, deformer.positions(), touched.nodes);
    return touched;
  }
};

// An edge of the skin, and the corner beside it on either side.
std::vector<std::array<std::uint32_t, 4>> hinges_of(const TouchedOrgan& organ, std::size_t nodes) {
  const TriangleMesh mesh{std::vector<Vector3d>(nodes, Vector3d::Zero()),
                          smooth_skin_faces(organ.proxy, organ.skin.steps),
                          {}};
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

// Four sites on the side that nothing holds, and four ways to go from each: square, along −y, and
// aslant.
template <class Use>
void each_touch(const TriangleMesh& proxy, const Use& use) {
  const std::vector<Vector3d> normals = vertex_normals(proxy);
  const Vector3d middle = bounds(proxy).center();
  for (const Vector3d& towards : {Vector3d(0, -1, 0), Vector3d(0.2, -1, 0.3),
                                  Vector3d(-0.3, -1, 0.1), Vector3d(0.5, -1, -0.3)}) {
    const auto cosine = [&](const Vector3d& v) {
      return (v - middle).normalized().dot(towards.normalized());
    };
    const auto& all = proxy.vertices;
    const auto site = std::max_element(
        all.begin(), all.end(),
        [&](const Vector3d& a, const Vector3d& b) { return cosine(a) < cosine(b); });
    const Vector3d out = normals[static_cast<std::size_t>(site - all.begin())];
    const Vector3d aside = out.unitOrthogonal(), other = out.cross(aside);
    for (const Vector3d& way : {out, Vector3d(0, -1, 0), Vector3d(out + 0.45 * aside),
                                Vector3d(out - 0.32 * aside + 0.32 * other)})
      use(*site, way.normalized());
  }
}

struct Beyond {
  double fold_deg = 0;  // 99 of 100 edges within reach of the tip are folded by no more
  double force = 0;     // the sum of all forces, of the finer organ's
};

// What the tissue as it is baked does against four times as many tetrahedra, and against a finer
// proxy on eight times as many, whose skin dents as sharply as a tip is.
Beyond beyond_finer(Touch touch) {
  const TriangleMesh surface = OrganPhantom({}).surface(5);
  const TouchedOrgan organ(surface, 480), finer(surface, 4000);
  const double cell_mm = 0.75 * mean_edge_length(organ.proxy);
  const MechanicsModel coarse = organ.mechanics(cell_mm),
                       fine = organ.mechanics(cell_mm / std::cbrt(4.0));
  MechanicsModel finest = finer.mechanics(cell_mm / 2);
  finest.body->patches.clear();
  finest.body->give_mm_per_n.clear();
  EXPECT_GT(fine.body->tetrahedra.size(), 3 * coarse.body->tetrahedra.size());
  std::vector<double> folds_deg;
  double force_n = 0, force_of_finest_n = 0;
  each_touch(organ.proxy, [&](const Vector3d& site, const Vector3d& out) {
    const auto ours = organ.touched(coarse, touch, site, out),
               theirs = organ.touched(fine, touch, site, out);
    for (const auto& hinge : hinges_of(organ, ours.nodes.size()))
      if ((0.5 * (ours.nodes[hinge[0]] + ours.nodes[hinge[1]]) - ours.tip_mm).norm() < kNear_mm)
        folds_deg.push_back(fold_deg(ours.nodes, hinge) - fold_deg(theirs.nodes, hinge));
    force_n += ours.force_n;
    force_of_finest_n += finer.touched(finest, touch, site, out).force_n;
  });
  EXPECT_GT(folds_deg.size(), 2000u);
  const auto high = folds_deg.begin() + std::ptrdiff_t(folds_deg.size() * 99 / 100);
  std::nth_element(folds_deg.begin(), high, folds_deg.end());
  return {*high, force_n / force_of_finest_n};
}

TEST(TissueBends, AsFinerTissueDoes) {
  const std::string sites = " at four sites, four ways each: ",
                    folds =
                        "folds of the skin beyond those of four times the tetrahedra, 99th "
                        "percentile",
                    force = "force by that of a proxy of 4,000 faces on eight times the tetrahedra";
  const Beyond poke = beyond_finer(Touch::poke), grab = beyond_finer(Touch::grab);
  expect({"pokes of 15 mm" + sites + folds, "degrees", poke.fold_deg, 5});
  expect({"grabs of 40 mm" + sites + folds, "degrees", grab.fold_deg, 5});
  // Between the vertices of a coarse proxy a dent stays wider than a tip.
  expect({"pokes of 15 mm" + sites + force, "×", poke.force, 1.5});
  expect({"grabs of 40 mm" + sites + force, "×", std::max(grab.force, 1 / grab.force), 1.5});
}

// Held by its back half, as the recipe for livers has it.
TEST(TissueBends, AlikeByProxiesThatAreAsGood) {
  constexpr double kAside_mm = 0.05, kMostPercent = 2, kFacing = 0.6;
  constexpr std::size_t kSites = 70;
  const TouchedOrgan organ(OrganPhantom({}).surface(5), 480);
  const TriangleMesh skin = smooth_skin_mesh(organ.proxy, organ.skin);
  const std::vector<Vector3d> normals = vertex_normals(skin);
  std::vector<std::size_t> facing;
  for (std::size_t v = 0; v < normals.size(); ++v)
    if (normals[v].y() < -kFacing) facing.push_back(v);
  ASSERT_GE(facing.size(), kSites);
  std::vector<double> least_n(kSites, std::numeric_limits<double>::infinity()), most_n(kSites, 0);
  for (int seed = 0; seed <= cases(3, 10); ++seed) {
    const TouchedOrgan moved = organ.aside(seed > 0 ? kAside_mm : 0, std::uint64_t(seed));
    const MechanicsModel mechanics = moved.mechanics(0, 0.5);
    for (std::size_t k = 0; k < kSites; ++k) {
      const std::size_t v = facing[k * facing.size() / kSites];
      const double force_n =
          moved.touched(mechanics, Touch::poke, skin.vertices[v], normals[v]).force_n;
      least_n[k] = std::min(least_n[k], force_n), most_n[k] = std::max(most_n[k], force_n);
    }
  }
  double widest = 0;
  for (std::size_t k = 0; k < kSites; ++k) widest = std::max(widest, most_n[k] / least_n[k] - 1);
  expect({"pokes of 15 mm at 70 sites, a proxy's vertices 0.05 mm aside: force, at the worst", "%",
          100 * widest, kMostPercent});
}

}  // namespace
}  // namespace organbake
