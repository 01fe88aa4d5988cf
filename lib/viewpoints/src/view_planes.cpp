// SPDX-License-Identifier: GPL-3.0-or-later
// The polyhedron behind the cameras' view planes by half-space intersection in exact arithmetic
// (CGAL): symmetric sets of cameras have vertices of more than three planes, which rounding would
// split at random.
#include "view_planes.h"

#include <CGAL/Convex_hull_3/dual/halfspace_intersection_3.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <boost/optional.hpp>
#include <optional>

namespace organbake {
namespace {

// Exact constructions too: whether a vertex lies on a plane is then a matter of yes or no. At most
// a few hundred planes: milliseconds.
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Polyhedron = CGAL::Surface_mesh<Kernel::Point_3>;
#if CGAL_VERSION_NR >= 1060000000
using MaybePoint = std::optional<Kernel::Point_3>;
#else
using MaybePoint = boost::optional<Kernel::Point_3>;
#endif

std::vector<Kernel::Plane_3> half_spaces(const std::vector<Eigen::Vector3d>& directions,
                                         double box) {
  std::vector<Kernel::Plane_3> planes;
  for (const Eigen::Vector3d& d : directions) planes.emplace_back(d.x(), d.y(), d.z(), -1);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      normal[axis] = side;
      planes.emplace_back(normal.x(), normal.y(), normal.z(), -box);
    }
  }
  return planes;
}

Eigen::Vector3d to_double(const Kernel::Point_3& p) {
  return {CGAL::to_double(p.exact().x()), CGAL::to_double(p.exact().y()),
          CGAL::to_double(p.exact().z())};
}

// CGAL hands vertices and facets out in an order that hangs on where they lie in memory: here they
// are ordered by place.
class OrderedPolyhedron {
 public:
  explicit OrderedPolyhedron(const Polyhedron& polyhedron)
      : polyhedron_(polyhedron),
        vertices_(polyhedron.vertices().begin(), polyhedron.vertices().end()) {
    std::sort(vertices_.begin(), vertices_.end(), [&](auto a, auto b) {
      return CGAL::lexicographically_xyz_smaller(polyhedron_.point(a), polyhedron_.point(b));
    });
    rank_.resize(vertices_.size());
    for (std::size_t i = 0; i < vertices_.size(); ++i)
      rank_[vertices_[i]] = static_cast<std::uint32_t>(i);
  }

  const std::vector<Polyhedron::Vertex_index>& vertices() const { return vertices_; }

  TriangleMesh fanned_surface() const {
    TriangleMesh surface;
    for (const auto vertex : vertices_)
      surface.vertices.push_back(to_double(polyhedron_.point(vertex)));
    for (const std::vector<std::uint32_t>& facet : facets())
      for (std::size_t i = 2; i < facet.size(); ++i)
        surface.faces.push_back({facet[0], facet[i - 1], facet[i]});
    return surface;
  }

 private:
  // Corners counter-clockwise, lowest first.
  std::vector<std::vector<std::uint32_t>> facets() const {
    std::vector<std::vector<std::uint32_t>> facets;
    for (const auto facet : polyhedron_.faces()) {
      std::vector<std::uint32_t>& corners = facets.emplace_back();
      for (const auto v : polyhedron_.vertices_around_face(polyhedron_.halfedge(facet)))
        corners.push_back(rank_[v]);
      std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    }
    std::sort(facets.begin(), facets.end());
    return facets;
  }

  const Polyhedron& polyhedron_;
  std::vector<Polyhedron::Vertex_index> vertices_;
  std::vector<std::uint32_t> rank_;
};

}  // namespace

PlanePolyhedron intersect_view_planes(const std::vector<Eigen::Vector3d>& directions, double box) {
  const std::vector<Kernel::Plane_3> planes = half_spaces(directions, box);
  Polyhedron polyhedron;
  CGAL::halfspace_intersection_3(planes.begin(), planes.end(), polyhedron, MaybePoint({0, 0, 0}));
  const OrderedPolyhedron ordered(polyhedron);
  PlanePolyhedron result;
  for (const auto v : ordered.vertices()) {
    PlanePolyhedron::Vertex vertex{.position = to_double(polyhedron.point(v)), .planes = {}};
    for (std::uint32_t p = 0; p < planes.size(); ++p) {
      if (!planes[p].has_on(polyhedron.point(v))) continue;
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
