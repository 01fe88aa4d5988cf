// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/cutting/cut_sheet.h"

namespace organbake {

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
