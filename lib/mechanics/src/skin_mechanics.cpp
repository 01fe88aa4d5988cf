// SPDX-License-Identifier: GPL-3.0-or-later
// How a proxy's vertices hang on the tetrahedra: by patches of nodes, and by a give for tools
// beyond what patches yield.
//
// A vertex that moves with the one tetrahedron in which it lies is a point: what pushes it sinks
// into the tissue the deeper, and what is pulled at it stands out the sharper, the finer the
// tetrahedra are, and between elements of its own size a skin gets creases. But a vertex stands for
// the skin about it: it carries the hat function over its faces. So forces on it act on the tissue
// under these, as Galerkin's method spreads loads, w_n = ∫ hat N_n / ∫ hat, and it moves as that
// tissue does in the mean. The mean of a bent patch lies beside the vertex, which would then turn
// about another point: so the weights are corrected to reproduce linear fields, as moving least
// squares do (Belytschko et al. 1996, "Meshless methods", 4.2).
#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_edges.h"
#include "tissue_parts.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Sums = std::map<std::uint32_t, double>;  // by node

constexpr double kBarelyHeld = 1e-9;  // as of anchors: what carries less does not count
constexpr double kFlatPatch = 1e-9;   // of the largest moment: across a flat patch nothing is known
// Of the sum of a patch's weights without their signs: a vertex at a tip that is sharper follows
// its tetrahedron.
constexpr double kMostLeverage = 2;

// The means of equal small triangles of a face are enough for what is linear in each tetrahedron.
template <class Use>
void each_sample(const TriangleMesh& mesh, const Face& face, double step_mm, const Use& use) {
  const Vector3d &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]],
                 &c = mesh.vertices[face[2]];
  const double longest = std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
  const int steps = std::max(1, static_cast<int>(std::ceil(longest / step_mm)));
  const double area = (b - a).cross(c - a).norm() / (2 * steps * steps);
  const auto sample = [&](double b1, double b2) {
    use(Vector3d(a + b1 / steps * (b - a) + b2 / steps * (c - a)), b1 / steps, b2 / steps, area);
  };
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; i + j < steps; ++j) {
      sample(i + 1.0 / 3, j + 1.0 / 3);
      if (i + j + 1 < steps) sample(i + 2.0 / 3, j + 2.0 / 3);
    }
  }
}

// Of a body that has no patches yet.
std::vector<NodeShare> own_tetrahedron(const TetrahedralBody& body, std::size_t vertex) {
  std::vector<NodeShare> patch;
  each_carrier(body, vertex, [&](std::uint32_t node, double weight) {
    if (weight != 0) patch.push_back({node, weight});
  });
  return patch;
}

// Weights of sum 1 that are nearest to the sums, in their own measure, and whose mean is `at`.
std::vector<NodeShare> consistent(const Sums& sums, const TetrahedralBody& body,
                                  const Vector3d& at) {
  double total = 0;
  Vector3d mean = Vector3d::Zero();
  for (const auto& [node, sum] : sums) total += sum, mean += sum * body.nodes_mm[node];
  mean /= total;
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const auto& [node, sum] : sums) {
    const Vector3d from_mean = body.nodes_mm[node] - mean;
    moment += sum / total * from_mean * from_mean.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moment);
  Vector3d tilt = Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (axes.eigenvalues()[axis] <= kFlatPatch * axes.eigenvalues()[2]) continue;
    const Vector3d along = axes.eigenvectors().col(axis);
    tilt += along.dot(at - mean) / axes.eigenvalues()[axis] * along;
  }
  std::vector<NodeShare> patch;
  for (const auto& [node, sum] : sums)
    patch.push_back({node, sum / total * (1 + tilt.dot(body.nodes_mm[node] - mean))});
  return patch;
}

double leverage(const std::vector<NodeShare>& patch) {
  double sum = 0;
  for (const NodeShare& share : patch) sum += std::abs(share.weight);
  return sum;
}

}  // namespace

std::vector<std::vector<NodeShare>> skin_patches(
    const TriangleMesh& skin, const TetrahedralBody& body, double step_mm,
    const std::function<std::optional<EmbeddedVertex>(const Vector3d&)>& place) {
  std::vector<Sums> sums(skin.vertices.size());
  for (const Face& face : skin.faces) {
    each_sample(skin, face, step_mm, [&](const Vector3d& at, double b1, double b2, double area) {
      const std::optional<EmbeddedVertex> found = place(at);
      if (!found) return;
      const double hats[3] = {1 - b1 - b2, b1, b2};
      for (int corner = 0; corner < 3; ++corner)
        for (std::size_t k = 0; k < 4; ++k)
          sums[face[corner]][body.tetrahedra[found->tetrahedron].nodes[k]] +=
              hats[corner] * area * found->weights[k];
    });
  }
  std::vector<std::vector<NodeShare>> patches;
  for (std::size_t v = 0; v < skin.vertices.size(); ++v) {
    patches.push_back(own_tetrahedron(body, v));
    // What is held stays held.
    const bool held =
        std::any_of(patches[v].begin(), patches[v].end(), [&](const NodeShare& share) {
          return share.weight >= kBarelyHeld &&
                 std::binary_search(body.anchors.begin(), body.anchors.end(), share.node);
        });
    if (held || sums[v].empty()) continue;
    std::vector<NodeShare> patch = consistent(sums[v], body, skin.vertices[v]);
    if (leverage(patch) <= kMostLeverage) patches[v] = std::move(patch);
  }
  return patches;
}

// A force on a patch of skin dents it less than the same force through a tool's tip does: it is
// spread wider, and tetrahedra of the patch's size bend less than tissue. What is missing is told
// by how far a vertex sinks below those round it. Under a round punch of radius a an elastic
// half-space sinks by (1 − ν²)/(2 E a) per force, and by (1 − ν²)/(π E r) at the distance r
// (Johnson 1985, "Contact Mechanics", 3.2 and 3.4); by how much the body as a whole gives way is
// common to both, and told well by the tetrahedra. Their own dent is that of the tissue near the
// vertex, held some edges away: what is farther moves vertex and neighbours alike.
namespace {

using Eigen::Vector3d;
using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr double kHeldFrom = 3;           // mean edges of the proxy
constexpr double kKiloPascal = 1e-3;      // N/mm²
constexpr double kRoundingPivot = 1e-12;  // of the largest

// −1 for anchors.
std::vector<Eigen::Index> number_points(std::size_t points,
                                        const std::vector<std::uint32_t>& anchors,
                                        Eigen::Index& count) {
  std::vector<Eigen::Index> number(points, 0);
  for (const std::uint32_t a : anchors) number[a] = -1;
  count = 0;
  for (Eigen::Index& n : number) {
    if (n >= 0) n = count++;
  }
  return number;
}

// V (λ ∇a ∇bᵀ + μ ∇b ∇aᵀ + μ ∇a·∇b 1): isotropic linear elasticity, N/mm.
void add_element(const MechanicsModel& model, const Tetrahedron& t,
                 const std::vector<Eigen::Index>& number, Triplets& entries) {
  const TetrahedralBody& body = *model.body;
  const Eigen::Matrix<double, 4, 3> gradients = gradients_of(body, t);
  const double e = kKiloPascal * model.young_modulus_kpa, nu = body.poisson_ratio;
  const double volume = t.fill * volume_of(body, t);
  const double mu = volume * e / (2 * (1 + nu));
  const double lambda = volume * e * nu / ((1 + nu) * (1 - 2 * nu));
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      const Eigen::Index i = number[t.nodes[a]], j = number[t.nodes[b]];
      if (i < 0 || j < 0) continue;
      const Eigen::RowVector3d ga = gradients.row(a), gb = gradients.row(b);
      const Eigen::Matrix3d block = lambda * ga.transpose() * gb + mu * gb.transpose() * ga +
                                    mu * ga.dot(gb) * Eigen::Matrix3d::Identity();
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) entries.emplace_back(3 * i + r, 3 * j + c, block(r, c));
    }
  }
}

// Vertex coordinates by the free nodes' coordinates.
Eigen::SparseMatrix<double> embedding_of(const TetrahedralBody& body,
                                         const std::vector<Eigen::Index>& number,
                                         Eigen::Index count) {
  Triplets entries;
  for (std::size_t v = 0; v < body.vertices.size(); ++v) {
    each_carrier(body, v, [&](std::uint32_t node, double weight) {
      const Eigen::Index i = number[node];
      if (i < 0) return;
      for (int axis = 0; axis < 3; ++axis) entries.emplace_back(3 * v + axis, 3 * i + axis, weight);
    });
  }
  Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(3 * body.vertices.size()),
                                     3 * count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// The tissue near a place with some of the vertices, in their order; nothing when none of it moves.
std::optional<MechanicsModel> tissue_near(const MechanicsModel& model, const Vector3d& at_mm,
                                          double within_mm,
                                          const std::vector<std::uint32_t>& vertices) {
  const TetrahedralBody& all = *model.body;
  MechanicsModel near;
  near.young_modulus_kpa = model.young_modulus_kpa;
  TetrahedralBody& body = near.body.emplace();
  body.poisson_ratio = all.poisson_ratio;
  body.nodes_mm = all.nodes_mm;
  std::vector<std::uint8_t> moves(all.nodes_mm.size(), 0), in_one(moves);
  for (std::size_t n = 0; n < moves.size(); ++n)
    moves[n] = (all.nodes_mm[n] - at_mm).norm() < within_mm;
  for (const std::uint32_t anchor : all.anchors) moves[anchor] = 0;
  for (const Tetrahedron& t : all.tetrahedra) {
    if (std::none_of(t.nodes.begin(), t.nodes.end(), [&](auto n) { return moves[n] != 0; }))
      continue;
    body.tetrahedra.push_back(t);
    for (const std::uint32_t n : t.nodes) in_one[n] = 1;
  }
  for (std::uint32_t n = 0; n < moves.size(); ++n)
    if (!moves[n] || !in_one[n]) body.anchors.push_back(n);
  if (body.anchors.size() == moves.size()) return std::nullopt;
  for (const std::uint32_t v : vertices) body.patches.push_back(all.patches[v]);
  body.vertices.resize(vertices.size());
  return near;
}

// By how much less the first of the vertices sinks below the others under a force on it than below
// them in an elastic half-space, under a tool's tip, mm per N.
double missing_dent(const TriangleMesh& proxy, const std::vector<std::uint32_t>& vertices,
                    const Vector3d& normal, const MechanicsModel& near, double radius_mm) {
  const auto count = static_cast<Eigen::Index>(vertices.size());
  Eigen::MatrixXd load = Eigen::MatrixXd::Zero(3 * count, 1);
  load.topRows<3>() = normal;
  const Eigen::MatrixXd moved = fem_displacements(near, load);
  const double nu = near.body->poisson_ratio,
               soft = (1 - nu * nu) / (kKiloPascal * near.young_modulus_kpa);
  double missing = soft / (2 * radius_mm) - normal.dot(Vector3d(moved.topRows<3>()));
  for (Eigen::Index k = 1; k < count; ++k) {
    const double away_mm = (proxy.vertices[vertices[k]] - proxy.vertices[vertices.front()]).norm();
    const double in_half_space = soft / (std::numbers::pi * std::max(away_mm, radius_mm));
    missing += (normal.dot(Vector3d(moved.middleRows<3>(3 * k))) - in_half_space) /
               static_cast<double>(count - 1);
  }
  return std::max(missing, 0.0);
}

}  // namespace

Eigen::MatrixXd fem_displacements(const MechanicsModel& model, const Eigen::MatrixXd& loads_n) {
  if (!model.body) throw BadDataError("the mechanics have no tetrahedra");
  const TetrahedralBody& body = *model.body;
  Eigen::Index count = 0;
  const auto number = number_points(body.nodes_mm.size(), body.anchors, count);
  Triplets entries;
  for (const Tetrahedron& t : body.tetrahedra) add_element(model, t, number, entries);
  Eigen::SparseMatrix<double> stiffness(3 * count, 3 * count);
  stiffness.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(stiffness);
  // A hinge leaves pivots of rounding, of either sign.
  if (count == 0 || factor.info() != Eigen::Success ||
      !(factor.vectorD().minCoeff() > kRoundingPivot * factor.vectorD().maxCoeff()))
    throw BadDataError("the tetrahedra can move as a whole: nothing holds some part of them");
  const Eigen::SparseMatrix<double> embedding = embedding_of(body, number, count);
  return embedding * factor.solve(Eigen::MatrixXd(embedding.transpose() * loads_n));
}

std::vector<double> skin_gives(const TriangleMesh& proxy, const MechanicsModel& model) {
  const VertexNeighbours neighbours(proxy.faces, proxy.vertices.size());
  const std::vector<Vector3d> normals = vertex_normals(proxy);
  const double within_mm = kHeldFrom * mean_edge_length(proxy);
  std::vector<std::uint8_t> held(proxy.vertices.size(), 0);
  for (const std::uint32_t anchor : model.anchors) held[anchor] = 1;
  std::vector<double> gives(proxy.vertices.size(), 0.0);
  parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(gives.size()), [&](std::uint32_t v) {
    std::vector<std::uint32_t> vertices = {v};
    for (const std::uint32_t n : neighbours.of(v)) vertices.push_back(n);
    if (held[v] || vertices.size() == 1) return;
    const auto near = tissue_near(model, proxy.vertices[v], within_mm, vertices);
    if (!near) return;
    try {
      gives[v] = missing_dent(proxy, vertices, normals[v], *near, model.instrument_radius_mm);
    } catch (const BadDataError&) {  // a loose part, held by nothing, which a tool pushes away
    }
  });
  return gives;
}

}  // namespace organbake
