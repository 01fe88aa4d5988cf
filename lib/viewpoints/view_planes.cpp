// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints/view_planes.h"

#include <CGAL/Convex_hull_3/dual/halfspace_intersection_3.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include <boost/optional.hpp>

namespace organbake {
namespace {

// Exact constructions too: whether a vertex lies on a plane is then a matter of yes or no. At most
// a few hundred planes: milliseconds.
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Polyhedron = CGAL::Surface_mesh<Kernel::Point_3>;

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
  return {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
}

TriangleMesh fanned_surface(const Polyhedron& polyhedron) {
  TriangleMesh surface;
  for (const auto vertex : polyhedron.vertices()) {
    surface.vertices.push_back(to_double(polyhedron.point(vertex)));
  }
  for (const auto facet : polyhedron.faces()) {
    std::vector<std::uint32_t> corners;
    for (const auto v : polyhedron.vertices_around_face(polyhedron.halfedge(facet))) {
      corners.push_back(v);
    }
    for (std::size_t i = 2; i < corners.size(); ++i) {
      surface.faces.push_back({corners[0], corners[i - 1], corners[i]});
    }
  }
  return surface;
}

}  // namespace

PlanePolyhedron intersect_view_planes(const std::vector<Eigen::Vector3d>& directions, double box) {
  const std::vector<Kernel::Plane_3> planes = half_spaces(directions, box);
  Polyhedron polyhedron;
  CGAL::halfspace_intersection_3(planes.begin(), planes.end(), polyhedron,
                                 boost::make_optional(Kernel::Point_3(0, 0, 0)));
  PlanePolyhedron result;
  for (const auto v : polyhedron.vertices()) {
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
  result.surface = fanned_surface(polyhedron);
  return result;
}

}  // namespace organbake
