// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "organbake/cutting/exact_orientation.h"

namespace organbake {

// A blade's edge at one moment, carried back to the body at rest: from its tip to its upper end,
// and at either end, where that stands out of the tissue, a place farther out: elements reach
// beyond the skin, and have to be cut there, too.
struct BladeLine {
  static constexpr int kPoints = 9;          // of the edge, from the tip upward
  static constexpr int kRows = kPoints + 2;  // with those farther out
  std::array<Eigen::Vector3d, kRows> points_mm;
  bool tip_is_out = false, top_is_out = false;
  bool all_out = false;  // of a blade beside the tissue, where elements stand out, too
};

// Where on a sheet: a blade line of a stroke, counted with fractions, and a row likewise.
struct SheetPlace {
  std::uint32_t stroke = 0;
  double line = 0, row = 0;
};

// What a blade swept through a body at rest: a strip between each two lines of a stroke that follow
// each other. Sheets may cross and touch each other, and themselves.
class CutSheet {
 public:
  struct Triangle {
    std::array<GridPoint, 3> corners;
    std::uint32_t stroke, line;                   // of the strip
    std::array<std::array<double, 2>, 3> places;  // of the corners: line and row
    bool farther_out;                             // no tissue there
    double fine_mm;                               // of the skin beside it, the longest edges
  };

  // Ranks of its points are from first_rank on.
  CutSheet(const MaterialGrid& grid, std::uint32_t first_rank)
      : grid_(grid), next_rank_(first_rank) {}

  // Beside a sheet the skin's faces are halved until no edge is longer.
  static constexpr double kFineSkin_mm = 2.5;
  // width_mm: of the strip of tissue that the blade takes away, half of it on either side.
  void begin_stroke(double width_mm = 0, double fine_mm = kFineSkin_mm) {
    strokes_.emplace_back(), widths_mm_.push_back(width_mm), fine_mm_ = fine_mm;
  }
  // To the last stroke.
  void add(const BladeLine& line);

  const std::vector<std::vector<BladeLine>>& strokes() const { return strokes_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  double width_mm(std::uint32_t stroke) const { return widths_mm_[stroke]; }
  // At rest, mm; a place beyond a stroke's ends is taken for the end.
  Eigen::Vector3d at(const SheetPlace& place) const;
  // Along the blade's edge from a place, mm per row.
  Eigen::Vector3d upward(const SheetPlace& place) const;
  // Along the blade's way, mm per line.
  Eigen::Vector3d onward(const SheetPlace& place) const;
  // Square to the sheet at a place, unit; zero where the blade stood still.
  Eigen::Vector3d across(const SheetPlace& place) const;

 private:
  MaterialGrid grid_;
  std::uint32_t next_rank_;
  std::vector<std::vector<BladeLine>> strokes_;
  std::vector<double> widths_mm_;                 // by stroke
  double fine_mm_ = kFineSkin_mm;                 // of the last one
  std::array<GridPoint, BladeLine::kRows> last_;  // of the last line
  std::vector<Triangle> triangles_;
};

// Where a segment meets a sheet's triangle that it crosses: its share of the segment, and the
// place.
struct SheetCrossing {
  double share = 0.5;
  SheetPlace place;
};
SheetCrossing crossing_of(const GridPoint& a, const GridPoint& b,
                          const CutSheet::Triangle& triangle);

}  // namespace organbake
