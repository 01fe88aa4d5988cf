// SPDX-License-Identifier: Apache-2.0
// Writes and reads mechanics.json: masses, springs, anchors and, where there are some, tetrahedra,
// with their geometry (volumes, node masses, gradients of their linear basis functions). Every
// index, number and sum of weights is checked here, so that the solver never meets a spring without
// length, a vertex that does not exist or an element inside out.
#include "organbake/bundle/mechanics_model.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "organbake/bundle/json_fields.h"

namespace organbake {
namespace {

constexpr double kFarthest_mm = 1e6;  // of a node from the world's origin
constexpr double kLongest_s = 1e6;
constexpr double kLeastVolume_mm3 = 1e-12;
// Weights of sum 1 that were written in full still are; edited ones that drift farther are wrong.
constexpr double kSumWithin = 1e-9;

// What `read` makes of each entry of a list.
template <class Read>
auto each(const JsonField& list, const Read& read) {
  std::vector<decltype(read(list))> all;
  for (std::size_t i = 0; i < list.size(); ++i) all.push_back(read(list.at(i)));
  return all;
}

// Likewise, of a list that has one for each vertex of the proxy.
template <class Read>
auto each_vertex(const JsonField& list, std::size_t vertex_count, const char* what,
                 const Read& read) {
  if (list.size() != vertex_count)
    list.fail("holds " + std::to_string(list.size()) + " " + what + " for the proxy's " +
              std::to_string(vertex_count) + " vertices");
  return each(list, read);
}

Eigen::Vector3d node_from(const JsonField& field) {
  const Eigen::Vector3d node = field.vector3();
  if (!(node.cwiseAbs().maxCoeff() <= kFarthest_mm)) field.fail("lies too far away");
  return node;
}

// Increasing, so each once.
std::vector<std::uint32_t> anchors_from(const JsonField& field, std::int64_t nodes) {
  std::int64_t last = -1;
  return each(field, [&](const JsonField& anchor) {
    return static_cast<std::uint32_t>(last = anchor.integer(last + 1, nodes - 1));
  });
}

Tetrahedron tetrahedron_from(const JsonField& corners, const JsonField& fill, std::int64_t nodes) {
  if (corners.size() != 4) corners.fail("needs four nodes");
  Tetrahedron tetrahedron;
  for (std::size_t k = 0; k < 4; ++k) {
    tetrahedron.nodes[k] = static_cast<std::uint32_t>(corners.at(k).integer(0, nodes - 1));
  }
  constexpr double kLeastFill = 1e-6;  // less would make a system that cannot be solved
  tetrahedron.fill = fill.number(kLeastFill, 1);
  return tetrahedron;
}

EmbeddedVertex vertex_from(const JsonField& field, std::int64_t tetrahedra) {
  EmbeddedVertex vertex;
  vertex.tetrahedron = static_cast<std::uint32_t>(field["tetrahedron"].integer(0, tetrahedra - 1));
  const JsonField weights = field["weights"];
  if (weights.size() != 4) weights.fail("needs four numbers");
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += vertex.weights[k] = weights.at(k).number(0, 1);
  if (!(std::abs(sum - 1) <= kSumWithin)) weights.fail("need a sum of 1");
  return vertex;
}

// Of skin that is bent strongly some weights are negative.
constexpr double kLargestShare = 2;

std::vector<NodeShare> patch_from(const JsonField& field, std::int64_t nodes) {
  const JsonField numbers = field["nodes"], weights = field["weights"];
  if (weights.size() != numbers.size()) weights.fail("needs one number for each of the nodes");
  std::vector<NodeShare> patch;
  double sum = 0;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    patch.push_back({static_cast<std::uint32_t>(numbers.at(k).integer(0, nodes - 1)),
                     weights.at(k).number(-kLargestShare, kLargestShare)});
    sum += patch.back().weight;
  }
  if (!(std::abs(sum - 1) <= kSumWithin)) weights.fail("need a sum of 1");
  return patch;
}

constexpr double kMostGive_mm_per_n = 1e9;

Json patch_to_json(const std::vector<NodeShare>& patch) {
  Json nodes = Json::array(), weights = Json::array();
  for (const auto& [node, weight] : patch) nodes.push_back(node), weights.push_back(weight);
  return {{"nodes", nodes}, {"weights", weights}};
}

}  // namespace

double volume_of(const TetrahedralBody& body, const Tetrahedron& tetrahedron) {
  const auto at = [&](int k) { return body.nodes_mm[tetrahedron.nodes[k]]; };
  return (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0)) / 6;
}

std::vector<double> node_masses_kg(const TetrahedralBody& body, double density_kg_per_m3) {
  constexpr double kCubicMetres = 1e-9;  // of mm³
  std::vector<double> masses(body.nodes_mm.size(), 0.0);
  for (const Tetrahedron& t : body.tetrahedra)
    for (const std::uint32_t node : t.nodes)
      masses[node] += 0.25 * t.fill * density_kg_per_m3 * kCubicMetres * volume_of(body, t);
  return masses;
}

Eigen::Matrix<double, 4, 3> gradients_of(const TetrahedralBody& body,
                                         const Tetrahedron& tetrahedron) {
  Eigen::Matrix3d edges;
  for (int k = 0; k < 3; ++k) {
    edges.col(k) = body.nodes_mm[tetrahedron.nodes[k + 1]] - body.nodes_mm[tetrahedron.nodes[0]];
  }
  Eigen::Matrix<double, 4, 3> gradients;
  gradients.bottomRows<3>() = edges.inverse();
  gradients.row(0) = -gradients.bottomRows<3>().colwise().sum();
  return gradients;
}

namespace {

Json tetrahedral_body_to_json(const TetrahedralBody& body) {
  Json nodes = Json::array(), corners = Json::array(), fill = Json::array();
  Json vertices = Json::array();
  for (const Eigen::Vector3d& node : body.nodes_mm) nodes.push_back(to_json(node));
  for (const Tetrahedron& t : body.tetrahedra) {
    corners.push_back(t.nodes);
    fill.push_back(t.fill);
  }
  for (const EmbeddedVertex& v : body.vertices) {
    vertices.push_back({{"tetrahedron", v.tetrahedron}, {"weights", v.weights}});
  }
  Json json = {{"poisson_ratio", body.poisson_ratio},
               {"damping_s", body.damping_s},
               {"nodes_mm", nodes},
               {"corners", corners},
               {"fill", fill},
               {"vertices", vertices},
               {"anchors", body.anchors}};
  for (const auto& patch : body.patches) json["patches"].push_back(patch_to_json(patch));
  if (!body.give_mm_per_n.empty()) json["give_mm_per_n"] = body.give_mm_per_n;
  return json;
}

TetrahedralBody tetrahedral_body_from_json(const JsonField& field, std::size_t vertex_count) {
  TetrahedralBody body;
  body.poisson_ratio = field["poisson_ratio"].number(0, 0.49);
  body.damping_s = field["damping_s"].number(0, kLongest_s);
  body.nodes_mm = each(field["nodes_mm"], node_from);
  const auto nodes = static_cast<std::int64_t>(body.nodes_mm.size());
  const JsonField corners = field["corners"], fill = field["fill"];
  if (fill.size() != corners.size()) fill.fail("needs one number for each of the corners");
  for (std::size_t i = 0; i < corners.size(); ++i) {
    body.tetrahedra.push_back(tetrahedron_from(corners.at(i), fill.at(i), nodes));
    if (!(volume_of(body, body.tetrahedra.back()) >= kLeastVolume_mm3)) {
      corners.at(i).fail("has no volume, or is inside out");
    }
  }
  const auto tetrahedra = static_cast<std::int64_t>(body.tetrahedra.size());
  body.vertices =
      each_vertex(field["vertices"], vertex_count, "places",
                  [&](const JsonField& vertex) { return vertex_from(vertex, tetrahedra); });
  if (const auto patches = field.find("patches"))
    body.patches = each_vertex(*patches, vertex_count, "patches",
                               [&](const JsonField& patch) { return patch_from(patch, nodes); });
  if (const auto gives = field.find("give_mm_per_n"))
    body.give_mm_per_n = each_vertex(*gives, vertex_count, "numbers", [](const JsonField& give) {
      return give.number(0, kMostGive_mm_per_n);
    });
  body.anchors = anchors_from(field["anchors"], nodes);
  return body;
}

constexpr const char* kMechanicsSchema = "organbake/mechanics/1";
constexpr double kTiny = 1e-300, kHuge = 1e12;  // positive, and far from overflow when multiplied

Spring spring_from(const JsonField& field, std::int64_t vertex_count) {
  Spring spring;
  spring.a = static_cast<std::uint32_t>(field["a"].integer(0, vertex_count - 1));
  spring.b = static_cast<std::uint32_t>(field["b"].integer(0, vertex_count - 1));
  if (spring.a == spring.b) field.fail("joins a vertex with itself");
  spring.rest_length_mm = field["rest_length_mm"].number(kTiny, kHuge);
  spring.stiffness_n_per_mm = field["stiffness_n_per_mm"].number(kTiny, kHuge);
  spring.damping_n_s_per_mm = field["damping_n_s_per_mm"].number(0, kHuge);
  return spring;
}

// Each vertex that is no anchor, once.
std::vector<std::uint32_t> order_from(const JsonField& field, const MechanicsModel& model) {
  std::vector<bool> waits(model.mass_kg.size(), true);
  for (const std::uint32_t anchor : model.anchors) waits[anchor] = false;
  const std::size_t free = waits.size() - model.anchors.size();
  if (field.size() != free) {
    field.fail("holds " + std::to_string(field.size()) + " vertices of the " +
               std::to_string(free) + " that are no anchors");
  }
  std::vector<std::uint32_t> order;
  for (std::size_t i = 0; i < free; ++i) {
    const JsonField entry = field.at(i);
    const auto v =
        static_cast<std::uint32_t>(entry.integer(0, static_cast<std::int64_t>(waits.size()) - 1));
    if (!waits[v]) entry.fail("names an anchor, or a vertex for the second time");
    waits[v] = false;
    order.push_back(v);
  }
  return order;
}

}  // namespace

std::string mechanics_to_json(const MechanicsModel& model) {
  Json springs = Json::array();
  for (const Spring& s : model.springs) {
    springs.push_back({{"a", s.a},
                       {"b", s.b},
                       {"rest_length_mm", s.rest_length_mm},
                       {"stiffness_n_per_mm", s.stiffness_n_per_mm},
                       {"damping_n_s_per_mm", s.damping_n_s_per_mm}});
  }
  Json json = {{"schema", kMechanicsSchema},
               {"tissue",
                {{"young_modulus_kpa", model.young_modulus_kpa},
                 {"density_kg_per_m3", model.density_kg_per_m3},
                 {"thickness_mm", model.thickness_mm},
                 {"volume_stiffness", model.volume_stiffness}}},
               {"instrument_radius_mm", model.instrument_radius_mm},
               {"mass_kg", model.mass_kg},
               {"anchors", model.anchors},
               {"springs", springs}};
  json["tissue"]["cut_gape_mm"] = model.cut_gape_mm;
  if (model.grasp_slip_n > 0) json["tissue"]["grasp_slip_n"] = model.grasp_slip_n;
  if (model.drag_per_s > 0) json["tissue"]["drag_per_s"] = model.drag_per_s;
  if (!model.elimination_order.empty()) json["elimination_order"] = model.elimination_order;
  if (model.body) json["tetrahedra"] = tetrahedral_body_to_json(*model.body);
  return json_text(json);
}

MechanicsModel mechanics_from_json(const std::string& text, const std::string& name,
                                   std::size_t vertex_count) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  document.require_schema(kMechanicsSchema);
  const auto vertices = static_cast<std::int64_t>(vertex_count);
  MechanicsModel model;
  const JsonField tissue = document["tissue"];
  model.young_modulus_kpa = tissue["young_modulus_kpa"].number(kTiny, kHuge);
  model.density_kg_per_m3 = tissue["density_kg_per_m3"].number(kTiny, kHuge);
  model.thickness_mm = tissue["thickness_mm"].number(kTiny, kHuge);
  model.volume_stiffness = tissue["volume_stiffness"].number(0, 1);
  tissue.read("cut_gape_mm", 0, kHuge, model.cut_gape_mm);
  tissue.read("grasp_slip_n", 0, kHuge, model.grasp_slip_n);
  tissue.read("drag_per_s", 0, kHuge, model.drag_per_s);
  model.instrument_radius_mm = document["instrument_radius_mm"].number(kTiny, kHuge);
  model.mass_kg = each_vertex(document["mass_kg"], vertex_count, "masses",
                              [](const JsonField& mass) { return mass.number(kTiny, kHuge); });
  model.anchors = anchors_from(document["anchors"], vertices);
  model.springs = each(document["springs"],
                       [&](const JsonField& spring) { return spring_from(spring, vertices); });
  if (const auto order = document.find("elimination_order")) {
    model.elimination_order = order_from(*order, model);
  }
  if (const auto body = document.find("tetrahedra")) {
    model.body = tetrahedral_body_from_json(*body, vertex_count);
  }
  return model;
}

}  // namespace organbake
