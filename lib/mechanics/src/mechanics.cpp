// SPDX-License-Identifier: GPL-3.0-or-later
// Springs, masses and anchors of a proxy. Edges by Van Gelder (1998), k = E·t·ΣA/L², so that a net
// of triangles stretches as a membrane of that modulus does whatever its meshing.
#include "organbake/mechanics/mechanics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "tissue_parts.h"

namespace organbake {
namespace {

constexpr double kKgPerMm3FromDensity = 1e-9;  // kg/m³ → kg/mm³
constexpr std::size_t kFewestAnchors = 3;      // what a rigid body needs to stay where it is

// A third of the faces round each vertex, mm².
std::vector<double> vertex_areas(const TriangleMesh& proxy) {
  std::vector<double> areas(proxy.vertices.size(), 0.0);
  for (std::size_t f = 0; f < proxy.faces.size(); ++f) {
    const double third = face_area(proxy, f) / 3;
    for (const std::uint32_t v : proxy.faces[f]) areas[v] += third;
  }
  return areas;
}

// Vertices of degenerate faces still need a mass; a thousandth of the mean moves nothing else.
std::vector<double> masses(const std::vector<double>& areas, const MechanicsOptions& options) {
  const double kg_per_mm2 = kKgPerMm3FromDensity * options.density_kg_per_m3 * options.thickness_mm;
  const double total = std::accumulate(areas.begin(), areas.end(), 0.0);
  const double least = 1e-3 * total / static_cast<double>(areas.size());
  std::vector<double> result;
  for (const double area : areas) result.push_back(kg_per_mm2 * std::max(area, least));
  return result;
}

// Van Gelder 1998: k = E·t·ΣArea/L², that is a bar of cross-section t·ΣArea/L. A needle's edge
// gets at least a strip of a hundredth of its length, lest its ends drift apart.
void add_surface_bar(const TriangleMesh& proxy, std::uint32_t a, std::uint32_t b, double area,
                     double thickness, SpringBuilder& network) {
  constexpr double kNarrowest = 0.01;
  const double length = (proxy.vertices[a] - proxy.vertices[b]).norm();
  if (!(length > 0)) return;
  network.add_bar(a, b, thickness * std::max(area / length, kNarrowest * length));
}

void add_surface(const TriangleMesh& proxy, double thickness, SpringBuilder& network) {
  // Stretch is the edges' work; the spring across an edge is there for shear and bending.
  constexpr double kBendingShare = 0.5;
  MeshEdges(proxy).for_each([&](std::span<const EdgeUse> uses) {
    double area_mm2 = 0;
    std::vector<std::pair<std::uint32_t, double>> opposite;  // corner, its face's area
    for (const EdgeUse& use : uses) {
      const std::uint32_t corner = use.opposite_corner();
      opposite.emplace_back(proxy.faces[corner / 3][corner % 3], face_area(proxy, use.face()));
      area_mm2 += opposite.back().second;
    }
    add_surface_bar(proxy, uses[0].low, uses[0].high, area_mm2, thickness, network);
    for (std::size_t i = 0; i < opposite.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const auto& [p, p_area] = opposite[i];
        const auto& [q, q_area] = opposite[j];
        if (p == q) continue;
        add_surface_bar(proxy, p, q, kBendingShare * (p_area + q_area), thickness, network);
      }
    }
  });
}

// The share of the used vertices that lies farthest along the direction.
std::vector<std::uint32_t> choose_anchors(const TriangleMesh& proxy,
                                          const std::vector<double>& areas,
                                          const MechanicsOptions& options) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t v = 0; v < areas.size(); ++v) {
    if (areas[v] > 0) order.push_back(v);
  }
  const Eigen::Vector3d direction = options.anchor_direction.stableNormalized();
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return proxy.vertices[a].dot(direction) > proxy.vertices[b].dot(direction);
  });
  const auto wanted = static_cast<std::size_t>(
      std::ceil(options.anchor_fraction * static_cast<double>(order.size())));
  order.resize(std::min(std::max(wanted, kFewestAnchors), order.size() - 1));
  std::sort(order.begin(), order.end());
  return order;
}

// The springs' dampers per stiffness, as their formulas have it: either solver damps about alike.
double damping_of(const std::vector<Spring>& springs) {
  double damping = 0, stiffness = 0;
  for (const Spring& s : springs) {
    damping += s.damping_n_s_per_mm;
    stiffness += s.stiffness_n_per_mm;
  }
  return stiffness > 0 ? damping / stiffness : 0;
}

// Of the layer of tissue under a sheet, which lies on what nobody saw: its underside is held.
TetrahedralBody layer_body(const TriangleMesh& sheet, const MechanicsModel& model, double cell_mm) {
  const TriangleMesh layer = tissue_layer(sheet, model.thickness_mm);
  std::vector<std::uint32_t> anchors = model.anchors;
  for (std::size_t v = sheet.vertices.size(); v < layer.vertices.size(); ++v)
    anchors.push_back(static_cast<std::uint32_t>(v));
  return make_lattice_body(layer, anchors, cell_mm, sheet);
}

TetrahedralBody body_of(const TriangleMesh& proxy, const MechanicsModel& model,
                        const MechanicsOptions& options, const RunContext& context) {
  TetrahedralBody body = is_sheet(proxy)
                             ? layer_body(proxy, model, options.fem_cell_mm)
                             : make_lattice_body(proxy, model.anchors, options.fem_cell_mm);
  if (body.anchors.size() == body.nodes_mm.size())
    throw UsageError("fem_cell_mm: cells of " + to_text(options.fem_cell_mm) +
                     " mm are so large that every node carries an anchor, and nothing could move; "
                     "take smaller ones");
  body.poisson_ratio = options.poisson_ratio;
  body.damping_s = damping_of(model.springs);
  const std::size_t parts = part_count(body);
  if (parts > 1) {
    context.warn(
        "the tetrahedra fall into " + std::to_string(parts) +
        " parts; one without an anchor drifts away when it is pushed. A larger fem_cell_mm joins "
        "parts that lie close");
  }
  return body;
}

}  // namespace

MechanicsModel make_mechanics(const TriangleMesh& proxy, const MechanicsOptions& options,
                              const RunContext& context) {
  if (const double length = options.anchor_direction.stableNorm();
      !(length > 0) || !std::isfinite(length))
    throw UsageError("anchor_direction must be finite and not zero");
  check_mesh(proxy, "proxy");
  const double area = surface_area(proxy);
  if (proxy.empty() || !(area > 0) || !std::isfinite(area)) {
    throw BadDataError(
        "proxy: its faces have no (finite) area, so it has neither mass nor springs");
  }
  constexpr double kSmallestBody_mm = 0.01;  // a fifth of what the thinnest tip can feel
  if (const double across_mm = bounds(proxy).diagonal(); !(across_mm >= kSmallestBody_mm)) {
    throw BadDataError("proxy: is " + to_text(across_mm) +
                       " mm across, which no tissue is; is its unit another one?");
  }
  const std::vector<double> areas = vertex_areas(proxy);
  MechanicsModel model;
  model.mass_kg = masses(areas, options);
  SpringBuilder network(proxy, options.young_modulus_kpa);
  add_surface(proxy, options.thickness_mm, network);
  context.throw_if_cancelled();
  add_body_struts(proxy, areas, network);
  tie_loose_parts(proxy, areas, network);
  model.springs = network.springs(model.mass_kg, options.damping_ratio);
  model.anchors = choose_anchors(proxy, areas, options);
  model.young_modulus_kpa = options.young_modulus_kpa;
  model.density_kg_per_m3 = options.density_kg_per_m3;
  model.thickness_mm = options.thickness_mm;
  model.volume_stiffness = options.volume_stiffness;
  model.instrument_radius_mm = options.instrument_radius_mm;
  model.cut_gape_mm = options.cut_gape_mm;
  model.grasp_slip_n = options.grasp_slip_n;
  model.drag_per_s = options.drag_per_s;
  if (options.fem) {
    model.body = body_of(proxy, model, options, context);
    model.body->give_mm_per_n = skin_gives(proxy, model);
  }
  model.elimination_order = elimination_order(model);
  return model;
}

}  // namespace organbake
