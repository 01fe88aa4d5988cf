// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <map>

#include "organbake/core/text.h"
#include "organbake/cutting/blade_sweeps.h"
#include "organbake/deform/deformer.h"
#include "organbake/mechanics/mechanics.h"
#include "promises.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

const Vector3d kBar_mm(80, 30, 30);
constexpr double kPull_n = 0.5;
constexpr int kSettled = 700;  // steps

// The bar's outside, quadrangles of `edge_mm` in two triangles each, about the origin.
TriangleMesh bar(double edge_mm) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const Eigen::Array3i count = (kBar_mm / edge_mm).array().round().cast<int>();
  const auto vertex = [&](const Eigen::Array3i& at) {
    const auto [found, made] = known.try_emplace({at.x(), at.y(), at.z()},
                                                 static_cast<std::uint32_t>(mesh.vertices.size()));
    if (made)
      mesh.vertices.push_back(
          (at.cast<double>() / count.cast<double>() - 0.5).matrix().cwiseProduct(kBar_mm));
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int one = (axis + 1) % 3, other = (axis + 2) % 3;
    for (const bool far : {false, true}) {
      for (int i = 0; i < count[one]; ++i) {
        for (int j = 0; j < count[other]; ++j) {
          const auto at = [&](int a, int b) {
            Eigen::Array3i place;
            place[axis] = far ? count[axis] : 0, place[one] = i + a, place[other] = j + b;
            return vertex(place);
          };
          const std::uint32_t p = at(0, 0), q = at(1, 0), r = at(1, 1), s = at(0, 1);
          const std::array<Face, 2> outward = {{{p, q, r}, {p, r, s}}};
          for (const auto& [a, b, c] : outward)
            mesh.faces.push_back(far ? Face{a, b, c} : Face{a, c, b});
        }
      }
    }
  }
  return mesh;
}

Bundle bar_of(double cell_mm) {
  Bundle organ;
  organ.manifest.name = "bar";
  organ.proxy = bar(2.5);
  MechanicsOptions options;
  options.fem = true;
  options.fem_cell_mm = cell_mm;
  organ.mechanics = make_mechanics(organ.proxy, options);
  // Held at one end.
  TetrahedralBody& body = *organ.mechanics.body;
  body.anchors.clear();
  for (std::uint32_t n = 0; n < body.nodes_mm.size(); ++n)
    if (body.nodes_mm[n].x() < 1 - kBar_mm.x() / 2) body.anchors.push_back(n);
  return organ;
}

// mm, of the lips half-way across, when the other end is pulled.
double opening_mm(double cell_mm) {
  CutOrgan organ(bar_of(cell_mm));
  BladeSweeps sweeps(organ);
  for (int i = 0; i <= 50; ++i) {
    const Vector3d tip(1.1, i - 25.0, 0);
    const CuttingStep now{0, {tip, tip + Vector3d(0, 0, 30)}};
    sweeps.advance(
        {&now, 1}, organ,
        organ.cut() ? organ.now().mechanics.body->nodes_mm : organ.body().uncut().nodes_mm);
    organ.part(sweeps.sheet());
  }
  const Bundle& cut = organ.now();
  const std::vector<Vector3d>& rest = cut.proxy.vertices;
  DeformOptions options;
  options.solver = TissueSolver::fem;
  options.tissue_contacts = false;
  Deformer deformer({{cut.proxy, cut.mechanics, cut.base, &*cut.skin}}, options);
  const auto at_end = [](const Vector3d& v) { return v.x() > kBar_mm.x() / 2 - 0.1; };
  const auto count = std::count_if(rest.begin(), rest.end(), at_end);
  std::vector<Vector3d> load(rest.size(), Vector3d::Zero());
  for (std::size_t v = 0; v < rest.size(); ++v)
    if (at_end(rest[v])) load[v].x() = kPull_n / double(count);
  deformer.set_load(load);
  for (int i = 0; i < kSettled; ++i) deformer.step({});
  double widest = 0;
  for (std::size_t a = 0; a < rest.size(); ++a) {
    if (!cut.skin->creased[a] || rest[a].z() < kBar_mm.z() / 2 - 0.01 || std::abs(rest[a].y()) > 3)
      continue;
    for (std::size_t b = 0; b < a; ++b)
      if (cut.skin->creased[b] && (rest[a] - rest[b]).norm() < 1e-9)
        widest = std::max(widest, (deformer.positions()[a] - deformer.positions()[b]).norm());
  }
  return widest;
}

TEST(CutOpenings, OfCoarseCellsAreNearThoseOfFineOnes) {
  const double fine = opening_mm(2.5);
  // Coarse cells hold a cut's end together: the chapter on playing says so.
  for (const auto& [cell_mm, most_percent] : {std::pair(10.0, 30.0), {5.0, 15.0}}) {
    const double off = 100 * std::abs(opening_mm(cell_mm) / fine - 1);
    expect({"a bar cut half through, cells of " + to_text(cell_mm) +
                " mm: its opening from that of cells of 2.5 mm, " + to_text(fine, 2) + " mm",
            "%", off, most_percent});
  }
}

}  // namespace
}  // namespace organbake
