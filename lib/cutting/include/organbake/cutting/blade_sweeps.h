// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "organbake/cutting/blade_path.h"
#include "organbake/cutting/cut_organ.h"
#include "organbake/cutting/cut_sheet.h"

namespace organbake {

// An instrument that cuts, and where its blade is now.
struct BladeNow {
  std::size_t instrument = 0;
  Blade blade;
  double width_mm = 0;  // of the strip of tissue that it takes away
  // It is lifted, and put down there first.
  std::optional<Blade> put_down = {};
};

// What blades have swept through an organ so far, carried back to the organ at rest.
class BladeSweeps {
 public:
  explicit BladeSweeps(const CutOrgan& organ) : sheet_(organ.clean_sheet()) {}

  // One step of the blades; those that are not among them are lifted. nodes_mm: where the nodes of
  // the organ's body lie as it hangs together now.
  void advance(std::span<const BladeNow> blades, const CutOrgan& organ,
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
