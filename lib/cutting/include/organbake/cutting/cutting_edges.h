// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "organbake/instruments/instrument.h"

namespace organbake {

// An edge that cuts, in the world, mm: a segment from its tip to its upper end.
struct CuttingEdge {
  Eigen::Vector3d tip_mm, top_mm;
};

// Where an instrument's edge cuts to in a time step.
struct CuttingStep {
  std::size_t instrument = 0;
  CuttingEdge edge;
  double width_mm = 0;  // of the strip of tissue that it takes away
  // It is lifted, and put down there first.
  std::optional<CuttingEdge> put_down = {};
};

// What the blades of scissors cut as they close: where their edges cross runs from the pivot to the
// tips, and all that lay between the blades behind it is parted. It is an edge that stands across
// the tool, as long as the opening was there when the blades began to close.
class ClosingScissors {
 public:
  struct Snip {
    std::optional<CuttingEdge> put_down;  // first, where the blades begin to close
    CuttingEdge edge;
  };
  // One step. tip_mm: half-way between the tips; pivot_mm: where the blades hang together;
  // opening_mm: from the one tip to the other. Nothing, unless the opening became less.
  std::optional<Snip> advance(const Eigen::Vector3d& tip_mm, const Eigen::Vector3d& pivot_mm,
                              const Eigen::Vector3d& opening_mm);

 private:
  Eigen::Vector3d opened_mm_ = Eigen::Vector3d::Zero();  // when they began to close
  double last_mm_ = 0;
};

// Where instruments cut, time step by time step: at the edge of each blade, and where scissors
// close. Instruments keep their places in the list.
class CuttingEdges {
 public:
  std::vector<CuttingStep> advance(const std::vector<Instrument>& instruments);
  void forget() { scissors_.clear(); }  // how far scissors were open

 private:
  std::map<std::size_t, ClosingScissors> scissors_;  // by instrument
};

}  // namespace organbake
