// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "organbake/bundle/bundle.h"

namespace organbake {

// Of what another solver tells the places.
enum class StateOf : std::uint8_t { vertices, nodes };  // of the proxy, of its tetrahedra

struct OrganState {
  std::vector<Eigen::Vector3d> vertices_mm;  // of the proxy, world
  std::vector<Eigen::Vector3d> nodes_mm;     // as they were read last
};

// Takes an organ's state from numbers of another program, with all checks. Several threads may read
// by one.
class StateReader {
 public:
  explicit StateReader(const Bundle& organ);  // which must outlive it; maps are not asked for
  ~StateReader();

  std::size_t count(StateOf of) const;  // of points in a state; 0 nodes where there are none
  // x y z of each point, world mm, as floats or doubles. Throws UsageError, and `state` then holds
  // anything, for another count, for what is not finite, and for what cannot be this organ: another
  // one, another unit.
  template <class Number>
  void read(std::span<const Number> xyz_mm, StateOf of, OrganState& state) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace organbake
