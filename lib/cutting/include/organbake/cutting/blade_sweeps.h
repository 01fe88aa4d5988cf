// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "organbake/cutting/blade_path.h"
#include "organbake/cutting/cut_organ.h"
#include "organbake/cutting/cut_sheet.h"
#include "organbake/cutting/cutting_edges.h"

namespace organbake {

// What blades have swept through an organ so far, carried back to the organ at rest.
class BladeSweeps {
 public:
  explicit BladeSweeps(const CutOrgan& organ) : sheet_(organ.clean_sheet()) {}

  // One time step of the edges that cut; those that are not among them are lifted. nodes_mm: where
  // the nodes of the organ's body lie as it hangs together now.
  void advance(std::span<const CuttingStep> steps, const CutOrgan& organ,
               const std::vector<Eigen::Vector3d>& nodes_mm);

  // A needle went through the skin at a place of the world: a hole as wide as the needle, some way
  // down along it. up_needle: unit, from its point.
  void pierce(const Eigen::Vector3d& at_mm, const Eigen::Vector3d& up_needle, double radius_mm,
              const CutOrgan& organ, const std::vector<Eigen::Vector3d>& nodes_mm);

  const CutSheet& sheet() const { return sheet_; }

 private:
  CutSheet sheet_;
  std::map<std::size_t, BladePath> paths_;  // by instrument
};

}  // namespace organbake
