// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "organbake/cutting/cut_body.h"

namespace organbake {

// The body in a deformed pose: from places of the world back to the tissue that lies there.
class PosedBody {
 public:
  // nodes_mm: of the cut body's nodes. Keeps both by reference.
  PosedBody(const CutBody& body, const std::vector<Eigen::Vector3d>& nodes_mm);

  struct Found {
    std::uint32_t copy;
    Eigen::Vector3d at_rest_mm;
  };
  const CutTetrahedra& cut() const { return body_.cut(); }
  // Copies whose tetrahedra may hold a place between the corners of a box.
  std::vector<std::uint32_t> near(const Eigen::Vector3d& low_mm,
                                  const Eigen::Vector3d& high_mm) const;
  // Of the copies given, in their order, the first that holds the tissue there.
  std::optional<Found> find(const Eigen::Vector3d& world_mm,
                            const std::vector<std::uint32_t>& copies) const;
  // At rest, as one copy carries it, be it far from it.
  Eigen::Vector3d at_rest(std::uint32_t copy, const Eigen::Vector3d& world_mm) const;

 private:
  std::array<double, 4> weights(std::uint32_t copy, const Eigen::Vector3d& world_mm) const;
  Eigen::Vector3d mixed(std::uint32_t copy, const std::array<double, 4>& weights) const;

  const CutBody& body_;
  const std::vector<Eigen::Vector3d>& nodes_mm_;
  std::vector<Eigen::Vector3d> low_, high_;  // boxes of the copies
};

}  // namespace organbake
