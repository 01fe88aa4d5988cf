// SPDX-License-Identifier: Apache-2.0
// From the world back to the tissue: barycentric weights in the deformed tetrahedron are those at
// rest, as linear elements have it.
#include "organbake/cutting/posed_body.h"

#include <Eigen/LU>
#include <algorithm>

namespace organbake {

PosedBody::PosedBody(const CutBody& body, const std::vector<Eigen::Vector3d>& nodes_mm)
    : body_(body), nodes_mm_(nodes_mm) {
  for (const CutTetrahedra::Copy& copy : body.cut().copies()) {
    Eigen::Vector3d low = nodes_mm[copy.nodes[0]], high = low;
    for (const std::uint32_t n : copy.nodes)
      low = low.cwiseMin(nodes_mm[n]), high = high.cwiseMax(nodes_mm[n]);
    low_.push_back(low), high_.push_back(high);
  }
}

std::array<double, 4> PosedBody::weights(std::uint32_t copy,
                                         const Eigen::Vector3d& world_mm) const {
  const auto& nodes = body_.cut().copies()[copy].nodes;
  Eigen::Matrix3d edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = nodes_mm_[nodes[k + 1]] - nodes_mm_[nodes[0]];
  const Eigen::Vector3d share = edges.inverse() * (world_mm - nodes_mm_[nodes[0]]);
  return {1 - share.sum(), share[0], share[1], share[2]};
}

Eigen::Vector3d PosedBody::mixed(std::uint32_t copy, const std::array<double, 4>& weights) const {
  const CutTetrahedra& cut = body_.cut();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k)
    sum += weights[k] * body_.uncut().nodes_mm[cut.original(cut.copies()[copy].nodes[k])];
  return sum;
}

std::vector<std::uint32_t> PosedBody::near(const Eigen::Vector3d& low_mm,
                                           const Eigen::Vector3d& high_mm) const {
  std::vector<std::uint32_t> copies;
  for (std::uint32_t copy = 0; copy < low_.size(); ++copy) {
    if ((low_mm.array() <= high_[copy].array()).all() &&
        (high_mm.array() >= low_[copy].array()).all())
      copies.push_back(copy);
  }
  return copies;
}

std::optional<PosedBody::Found> PosedBody::find(const Eigen::Vector3d& world_mm,
                                                const std::vector<std::uint32_t>& copies) const {
  for (const std::uint32_t copy : copies) {
    if ((world_mm.array() < low_[copy].array()).any() ||
        (world_mm.array() > high_[copy].array()).any())
      continue;
    const std::array<double, 4> w = weights(copy, world_mm);
    if (!(*std::min_element(w.begin(), w.end()) >= -CutBody::kRoundedWeight))
      continue;  // or a flattened element, not a number
    const Eigen::Vector3d at = mixed(copy, w);
    if (body_.holds(copy, at)) return Found{copy, at};
  }
  return std::nullopt;
}

Eigen::Vector3d PosedBody::at_rest(std::uint32_t copy, const Eigen::Vector3d& world_mm) const {
  return mixed(copy, weights(copy, world_mm));
}

}  // namespace organbake
