// SPDX-License-Identifier: Apache-2.0
// An organ's meshes and mechanics for other solvers, in the standard library's types; forces on the
// proxy as forces on the nodes that carry it; and the one place where a tip's flags become a kind:
// what an embedding program sees may not change with what an Instrument is inside.
#include "organbake/player/embedded_types.h"

#include <string>
#include <string_view>

#include "organbake/core/error.h"

namespace organbake {
namespace {

InstrumentKind kind_of(const EmbeddedPlayer::Tip& tip, std::size_t place) {
  if (tip.grabs + tip.cuts + tip.snips + tip.pierces > 1)
    throw UsageError("tip " + std::to_string(place) +
                     " does more than one of grabs, cuts, snips and pierces");
  if (tip.pierces) return Needle{};
  if (tip.snips) return Scissors{.opening_mm = Eigen::Vector3d(tip.opening_mm.data())};
  if (tip.cuts) return Blade{};
  if (tip.grabs) return Grasper{};
  return Ball{};
}

// Of the tip's numbers those that the kind has.
void take_numbers(const EmbeddedPlayer::Tip& tip, InstrumentKind& kind) {
  each_number_of(kind, [&](const InstrumentNumber& own, double& value) {
    each_number(tip, [&](const InstrumentNumber& given, double of_tip) {
      if (std::string_view(given.name) == own.name) value = of_tip;
    });
  });
}

void add_tetrahedra(const MechanicsModel& mechanics, EmbeddedPlayer::Mesh& mesh) {
  const TetrahedralBody& body = *mechanics.body;
  mesh.nodes_mm = points_of(body.nodes_mm);
  for (const Tetrahedron& t : body.tetrahedra) {
    mesh.tetrahedra.push_back(t.nodes);
    mesh.fill.push_back(t.fill);
  }
  mesh.node_mass_kg = node_masses_kg(body, mechanics.density_kg_per_m3);
  mesh.node_anchors = body.anchors;
  for (const EmbeddedVertex& v : body.vertices) {
    mesh.vertex_tetrahedron.push_back(v.tetrahedron);
    mesh.vertex_weights.push_back(v.weights);
  }
  if (!body.patches.empty()) mesh.patch_first = {0};
  for (const auto& patch : body.patches) {
    for (const auto& [node, weight] : patch)
      mesh.patch_nodes.push_back(node), mesh.patch_weights.push_back(weight);
    mesh.patch_first.push_back(static_cast<std::uint32_t>(mesh.patch_nodes.size()));
  }
  mesh.poisson_ratio = body.poisson_ratio;
  mesh.damping_s = body.damping_s;
}

}  // namespace

std::vector<Instrument> instruments_from(const std::vector<EmbeddedPlayer::Tip>& tips) {
  std::vector<Instrument> instruments;
  for (const EmbeddedPlayer::Tip& tip : tips) {
    instruments.push_back({Eigen::Vector3d(tip.position_mm.data()), tip.radius_mm,
                           kind_of(tip, instruments.size()), tip.active,
                           Eigen::Vector3d(tip.axis_mm.data())});
    take_numbers(tip, instruments.back().kind);
  }
  return instruments;
}

std::vector<EmbeddedPlayer::Point> points_of(const std::vector<Eigen::Vector3d>& vectors) {
  std::vector<EmbeddedPlayer::Point> points;
  points.reserve(vectors.size());
  for (const Eigen::Vector3d& v : vectors) points.push_back({v.x(), v.y(), v.z()});
  return points;
}

EmbeddedPlayer::Mesh organ_mesh(const Bundle& bundle) {
  const MechanicsModel& mechanics = bundle.mechanics;
  EmbeddedPlayer::Mesh mesh;
  mesh.vertices_mm = points_of(bundle.proxy.vertices);
  mesh.faces = bundle.proxy.faces;
  mesh.vertex_mass_kg = mechanics.mass_kg;
  mesh.vertex_anchors = mechanics.anchors;
  for (const Spring& s : mechanics.springs) {
    mesh.spring_ends.push_back({s.a, s.b});
    mesh.spring_length_mm.push_back(s.rest_length_mm);
    mesh.spring_stiffness_n_per_mm.push_back(s.stiffness_n_per_mm);
    mesh.spring_damping_n_s_per_mm.push_back(s.damping_n_s_per_mm);
  }
  mesh.young_modulus_kpa = mechanics.young_modulus_kpa;
  mesh.density_kg_per_m3 = mechanics.density_kg_per_m3;
  mesh.thickness_mm = mechanics.thickness_mm;
  mesh.volume_stiffness = mechanics.volume_stiffness;
  if (mechanics.body) add_tetrahedra(mechanics, mesh);
  if (bundle.skin) {
    mesh.skin_first = bundle.skin->first;
    mesh.skin_carriers = bundle.skin->carrier;
    mesh.skin_weights = bundle.skin->weight;
    mesh.skin_faces = smooth_skin_faces(bundle.proxy, bundle.skin->steps);
  }
  return mesh;
}

std::vector<Eigen::Vector3d> forces_on_nodes(const Bundle& bundle,
                                             const std::vector<Eigen::Vector3d>& on_vertices) {
  if (!bundle.mechanics.body)
    throw UsageError(
        "this organ has no tetrahedra whose nodes could be pushed; bake it anew "
        "without --set mechanics.fem=false");
  const TetrahedralBody& body = *bundle.mechanics.body;
  std::vector<Eigen::Vector3d> on_nodes(body.nodes_mm.size(), Eigen::Vector3d::Zero());
  for (std::size_t v = 0; v < on_vertices.size(); ++v) {
    each_carrier(body, v, [&](std::uint32_t node, double weight) {
      on_nodes[node] += weight * on_vertices[v];
    });
  }
  return on_nodes;
}

}  // namespace organbake
