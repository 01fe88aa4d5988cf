// SPDX-License-Identifier: Apache-2.0
#pragma once

// What blades swept, and exactly where it crosses edges.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace organbake {

// A point on a grid of whole numbers, and its rank among all points that meet in a predicate: no
// two of one rank may. Ranks decide what lies exactly on something else, always the same way.
struct GridPoint {
  std::array<std::int64_t, 3> at{};
  std::uint32_t rank = 0;
};

// Steps of about a nanometre about a middle. Points beyond 2 m from it are moved to the border.
class MaterialGrid {
 public:
  MaterialGrid() = default;
  explicit MaterialGrid(const Eigen::Vector3d& middle_mm) : middle_mm_(middle_mm) {}

  GridPoint snapped(const Eigen::Vector3d& point_mm, std::uint32_t rank) const;
  Eigen::Vector3d place_mm(const GridPoint& point) const;
  // All of them, with the ranks from `first_rank` on.
  std::vector<GridPoint> snapped(const std::vector<Eigen::Vector3d>& points_mm,
                                 std::uint32_t first_rank) const;

 private:
  Eigen::Vector3d middle_mm_ = Eigen::Vector3d::Zero();
};

// Whether d lies on the side of the plane (a, b, c) from which the three run clockwise (+1), or on
// the other (−1): the sign of (b − a) × (c − a) · (d − a), exact. Where that is zero, the points
// are taken for moved by infinitely little, by their ranks (simulation of simplicity, Edelsbrunner
// & Mücke 1990), so that it never is and no two answers contradict each other.
int orientation(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d);

// Whether the segment from a to b passes through the triangle.
bool crosses(const GridPoint& a, const GridPoint& b, const std::array<GridPoint, 3>& triangle);

// A blade's edge at one moment, carried back to the body at rest: from its tip to its upper end,
// and at either end, where that stands out of the tissue, a place farther out: elements reach
// beyond the skin, and have to be cut there, too.
struct BladeLine {
  static constexpr int kPoints = 9;          // of the edge, from the tip upward
  static constexpr int kRows = kPoints + 2;  // with those farther out
  std::array<Eigen::Vector3d, kRows> points_mm;
  bool tip_is_out = false, top_is_out = false;
  bool all_out = false;    // of a blade beside the tissue, where elements stand out, too
  std::uint32_t step = 0;  // of time, in which it was swept
  std::optional<Eigen::Vector3d> skin_mm = {};  // where it stood out of tissue then, world
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
  // Of time, in which the lines are swept that follow.
  void set_step(std::size_t step) { step_ = static_cast<std::uint32_t>(step); }
  // To the last stroke.
  void add(const BladeLine& line);

  const std::vector<std::vector<BladeLine>>& strokes() const { return strokes_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  std::size_t bytes() const;  // of memory
  double width_mm(std::uint32_t stroke) const { return widths_mm_[stroke]; }
  // Whether it is about as long as it is wide, as a needle's.
  bool is_hole(std::uint32_t stroke) const;
  // When a place was swept, in steps of time.
  double step(const SheetPlace& place) const;
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
  std::uint32_t next_rank_, step_ = 0;
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

// A box of grid steps.
struct GridBox {
  std::array<std::int64_t, 3> low, high;

  explicit GridBox(const GridPoint& point) : low(point.at), high(point.at) {}
  void add(const GridPoint& point);
  void add(const GridBox& other);
  bool meets(const GridBox& other) const;
};
GridBox box_of(const CutSheet::Triangle& triangle);

// The edges of a mesh at rest, each once, and where sheets cross them.
class EdgeCrossings {
 public:
  using Edge = std::array<std::uint32_t, 2>;  // the lower vertex first
  // Both ends keep at least this share of an edge: cut pieces are no slivers.
  static constexpr double kLeastShare = 0.03;

  struct Crossed {
    bool cut = false;
    // Of the crossings the one nearest to the edge's first vertex, and the farthest.
    SheetCrossing first, last;
    // Where the edge falls in two.
    double share() const;
  };

  // points: of the mesh, with their ranks.
  EdgeCrossings(std::vector<GridPoint> points, std::vector<Edge> edges);

  std::size_t count() const { return edges_.size(); }
  const Edge& edge(std::uint32_t e) const { return edges_[e]; }
  std::uint32_t index_of(std::uint32_t a, std::uint32_t b) const;  // of an edge that there is
  const Crossed& operator[](std::uint32_t e) const { return crossed_[e]; }
  bool cut(std::uint32_t e) const { return crossed_[e].cut; }
  // By vertex: whether an edge is cut that ends there.
  std::vector<std::uint8_t> beside_cuts() const;
  const GridPoint& point(std::uint32_t vertex) const { return points_[vertex]; }
  const std::vector<GridPoint>& points() const { return points_; }

  // Of the same mesh once it was made finer. points_mm: with those that came to it, whose ranks are
  // their numbers from first_rank on. What crossed edges that there still are is taken over; of the
  // triangles that were taken, those that cross the others are looked for.
  EdgeCrossings finer(const std::vector<Eigen::Vector3d>& points_mm, const MaterialGrid& grid,
                      std::uint32_t first_rank, std::vector<Edge> edges,
                      std::span<const CutSheet::Triangle> taken) const;
  // Takes more triangles of a sheet. Returns whether an edge is cut now that was not.
  bool add(std::span<const CutSheet::Triangle> triangles);

 private:
  void keep_crossings(const EdgeCrossings& before, std::span<const CutSheet::Triangle> taken);
  bool cross(std::uint32_t edge, std::span<const CutSheet::Triangle> triangles,
             std::span<const GridBox> boxes, const GridBox& all);

  std::vector<GridPoint> points_;
  std::vector<Edge> edges_;  // sorted
  std::vector<Crossed> crossed_;
};

}  // namespace organbake
