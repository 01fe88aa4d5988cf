// SPDX-License-Identifier: GPL-3.0-or-later
// A vertex that moves with the one tetrahedron in which it lies is a point: what pushes it sinks
// into the tissue the deeper, and what is pulled at it stands out the sharper, the finer the
// tetrahedra are, and between elements of its own size a skin gets creases. But a vertex stands for
// the skin about it: it carries the hat function over its faces. So forces on it act on the tissue
// under these, as Galerkin's method spreads loads, w_n = ∫ hat N_n / ∫ hat, and it moves as that
// tissue does in the mean. The mean of a bent patch lies beside the vertex, which would then turn
// about another point: so the weights are corrected to reproduce linear fields, as moving least
// squares do (Belytschko et al. 1996, "Meshless methods", 4.2).
#include "skin_patches.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

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

}  // namespace organbake
