// SPDX-License-Identifier: Apache-2.0
// Geometry of the tetrahedra (volumes, node masses, gradients of their linear basis functions), and
// their part of mechanics.json, read with a check of every index and every sum of weights.
#include "organbake/bundle/tetrahedral_body.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "tetrahedral_body_json.h"

namespace organbake {
namespace {

constexpr double kFarthest_mm = 1e6;  // of a node from the world's origin
constexpr double kLongest_s = 1e6;
constexpr double kLeastVolume_mm3 = 1e-12;
// Weights of sum 1 that were written in full still are; edited ones that drift farther are wrong.
constexpr double kSumWithin = 1e-9;

std::vector<Eigen::Vector3d> nodes_from(const JsonField& field) {
  std::vector<Eigen::Vector3d> nodes;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const JsonField node = field.at(i);
    nodes.push_back(node.vector3());
    if (!(nodes.back().cwiseAbs().maxCoeff() <= kFarthest_mm)) node.fail("lies too far away");
  }
  return nodes;
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

std::vector<std::vector<NodeShare>> patches_from(const JsonField& field, std::size_t vertex_count,
                                                 std::int64_t nodes) {
  if (field.size() != vertex_count) {
    field.fail("holds " + std::to_string(field.size()) + " patches for the proxy's " +
               std::to_string(vertex_count) + " vertices");
  }
  std::vector<std::vector<NodeShare>> patches;
  for (std::size_t v = 0; v < vertex_count; ++v) patches.push_back(patch_from(field.at(v), nodes));
  return patches;
}

constexpr double kMostGive_mm_per_n = 1e9;

std::vector<double> gives_from(const JsonField& field, std::size_t vertex_count) {
  if (field.size() != vertex_count) {
    field.fail("holds " + std::to_string(field.size()) + " numbers for the proxy's " +
               std::to_string(vertex_count) + " vertices");
  }
  std::vector<double> gives;
  for (std::size_t v = 0; v < vertex_count; ++v)
    gives.push_back(field.at(v).number(0, kMostGive_mm_per_n));
  return gives;
}

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
  body.nodes_mm = nodes_from(field["nodes_mm"]);
  const auto nodes = static_cast<std::int64_t>(body.nodes_mm.size());
  const JsonField corners = field["corners"], fill = field["fill"];
  if (fill.size() != corners.size()) fill.fail("needs one number for each of the corners");
  for (std::size_t i = 0; i < corners.size(); ++i) {
    body.tetrahedra.push_back(tetrahedron_from(corners.at(i), fill.at(i), nodes));
    if (!(volume_of(body, body.tetrahedra.back()) >= kLeastVolume_mm3)) {
      corners.at(i).fail("has no volume, or is inside out");
    }
  }
  const JsonField vertices = field["vertices"];
  if (vertices.size() != vertex_count) {
    vertices.fail("holds " + std::to_string(vertices.size()) + " vertices for the proxy's " +
                  std::to_string(vertex_count));
  }
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    body.vertices.push_back(
        vertex_from(vertices.at(v), static_cast<std::int64_t>(body.tetrahedra.size())));
  }
  if (const auto patches = field.find("patches"))
    body.patches = patches_from(*patches, vertex_count, nodes);
  if (const auto gives = field.find("give_mm_per_n"))
    body.give_mm_per_n = gives_from(*gives, vertex_count);
  const JsonField anchors = field["anchors"];
  std::int64_t last = -1;
  for (std::size_t i = 0; i < anchors.size(); ++i) {
    last = anchors.at(i).integer(last + 1, nodes - 1);  // increasing, so each once
    body.anchors.push_back(static_cast<std::uint32_t>(last));
  }
  return body;
}

}  // namespace organbake
