// SPDX-License-Identifier: GPL-3.0-or-later
// The polyhedron behind the cameras' view planes, by the convex hull of the planes' duals (CGAL):
// the plane d · x = 1 becomes the point d, a vertex the facet of the points whose planes meet in
// it. Exact predicates tell which more than three planes meet in one vertex, as symmetric sets of
// cameras have them and rounding would split at random; vertices themselves are fractions until
// they are read. Milliseconds for the few hundred planes of an organ, and a third of the compiler's
// work that the same intersection with exact constructions takes.
#include "placing.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>
#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <map>

namespace organbake {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Hull = CGAL::Surface_mesh<Point>;
using ExactPoint = std::array<mpq_class, 3>;

// Those of the directions, then those of the box.
std::vector<Point> dual_points(const std::vector<Eigen::Vector3d>& directions, double box) {
  std::vector<Point> points;
  for (const Eigen::Vector3d& d : directions) points.emplace_back(d.x(), d.y(), d.z());
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1 / box, 1 / box}) {
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      p[axis] = side;
      points.emplace_back(p.x(), p.y(), p.z());
    }
  }
  return points;
}

// Where the planes of three dual points meet: by Cramer's rule.
ExactPoint common_point(const std::array<Point, 3>& planes) {
  std::array<ExactPoint, 3> rows;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) rows[r][c] = mpq_class(planes[r][c]);
  const auto determinant = [](const std::array<ExactPoint, 3>& m) {
    return mpq_class(m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                     m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                     m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]));
  };
  const mpq_class whole = determinant(rows);
  ExactPoint point;
  for (int c = 0; c < 3; ++c) {
    std::array<ExactPoint, 3> with_ones = rows;
    for (ExactPoint& row : with_ones) row[c] = 1;
    point[c] = determinant(with_ones) / whole;
  }
  return point;
}

// The hull hands vertices and facets out in an order of its own: here they are ordered by place.
class OrderedPolyhedron {
 public:
  explicit OrderedPolyhedron(std::vector<Point> points) : points_(std::move(points)) {
    CGAL::convex_hull_3(points_.begin(), points_.end(), hull_);
    for (const auto facet : hull_.faces()) {
      const std::array<Point, 3> corners = corners_of(facet);
      planes_of_[facet] = planes_through(corners);
      place_.try_emplace(planes_of_[facet], common_point(corners));
    }
    for (const auto& [planes, place] : place_) order_.push_back(&planes);
    std::sort(order_.begin(), order_.end(),
              [&](const auto* a, const auto* b) { return place_.at(*a) < place_.at(*b); });
    for (std::size_t i = 0; i < order_.size(); ++i)
      rank_[*order_[i]] = static_cast<std::uint32_t>(i);
  }

  // By rank: the numbers of the dual points whose planes meet there, increasing.
  const std::vector<const std::vector<std::uint32_t>*>& vertices() const { return order_; }

  Eigen::Vector3d position(const std::vector<std::uint32_t>& planes) const {
    const ExactPoint& p = place_.at(planes);
    return {p[0].get_d(), p[1].get_d(), p[2].get_d()};
  }

  TriangleMesh fanned_surface() const {
    TriangleMesh surface;
    for (const auto* planes : order_) surface.vertices.push_back(position(*planes));
    for (const std::vector<std::uint32_t>& facet : facets())
      for (std::size_t i = 2; i < facet.size(); ++i)
        surface.faces.push_back({facet[0], facet[i - 1], facet[i]});
    return surface;
  }

 private:
  using Planes = std::vector<std::uint32_t>;

  std::array<Point, 3> corners_of(Hull::Face_index facet) const {
    std::array<Point, 3> corners;
    auto next = corners.begin();
    for (const auto v : hull_.vertices_around_face(hull_.halfedge(facet))) *next++ = hull_.point(v);
    return corners;
  }

  Planes planes_through(const std::array<Point, 3>& corners) const {
    Planes planes;
    for (std::uint32_t p = 0; p < points_.size(); ++p)
      if (CGAL::coplanar(corners[0], corners[1], corners[2], points_[p])) planes.push_back(p);
    return planes;
  }

  // One for each corner of the hull: the vertices round it counter-clockwise, lowest first.
  std::vector<std::vector<std::uint32_t>> facets() const {
    std::vector<std::vector<std::uint32_t>> facets;
    for (const auto plane : hull_.vertices()) {
      std::vector<std::uint32_t> corners;
      for (const auto facet : hull_.faces_around_target(hull_.halfedge(plane)))
        corners.push_back(rank_.at(planes_of_.at(facet)));
      std::reverse(corners.begin(), corners.end());  // CGAL goes round clockwise
      std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
      corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
      while (corners.size() > 1 && corners.back() == corners.front()) corners.pop_back();
      if (corners.size() > 2) facets.push_back(std::move(corners));
    }
    std::sort(facets.begin(), facets.end());
    return facets;
  }

  std::vector<Point> points_;
  Hull hull_;
  std::map<Hull::Face_index, Planes> planes_of_;
  std::map<Planes, ExactPoint> place_;
  std::map<Planes, std::uint32_t> rank_;
  std::vector<const Planes*> order_;
};

}  // namespace

PlanePolyhedron intersect_view_planes(const std::vector<Eigen::Vector3d>& directions, double box) {
  const OrderedPolyhedron ordered(dual_points(directions, box));
  PlanePolyhedron result;
  for (const auto* planes : ordered.vertices()) {
    PlanePolyhedron::Vertex vertex{.position = ordered.position(*planes), .planes = {}};
    for (const std::uint32_t p : *planes) {
      if (p < directions.size()) {
        vertex.planes.push_back(p);
      } else {
        vertex.on_box = true;
      }
    }
    result.vertices.push_back(std::move(vertex));
  }
  result.surface = ordered.fanned_surface();
  return result;
}

}  // namespace organbake
