// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

namespace organbake {

using Polygon2 = std::vector<Eigen::Vector2d>;
// Stretches of a row, in increasing order and apart: from, to.
using Spans = std::vector<std::pair<double, double>>;

// What closed contours in one plane enclose: their union, but for one that lies inside another,
// which is a hole in it, as one inside that hole is an island. The same contour twice counts once.
// Each by itself encloses what the even-odd rule says, so that a hole by keyhole is a hole, too.
class ContourRegion {
 public:
  // One contour, or several that the even-odd rule holds for together.
  using Contour = std::vector<Polygon2>;

  explicit ContourRegion(std::vector<Contour> contours);

  // What of a row lies inside. With a `reach` what is that near to the edge belongs to it, on
  // either side of a hole's edge, too.
  Spans row(double y, double reach = 0) const;
  std::size_t holes() const { return holes_; }
  std::size_t repeated() const { return repeated_; }

 private:
  struct Layered {
    Contour contour;
    std::size_t depth = 0;  // even adds to what lies below, odd takes away
  };
  std::vector<Layered> contours_;  // by depth
  std::size_t holes_ = 0, repeated_ = 0;
};

}  // namespace organbake
