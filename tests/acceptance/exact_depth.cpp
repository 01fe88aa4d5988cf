// SPDX-License-Identifier: GPL-3.0-or-later
#include "exact_depth.h"

#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/version.h>

#include <limits>
#include <vector>

#if CGAL_VERSION_NR >= 1060000000
#include <CGAL/AABB_traits_3.h>
#include <CGAL/AABB_triangle_primitive_3.h>
#else
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_triangle_primitive.h>
#endif

namespace organbake {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
#if CGAL_VERSION_NR >= 1060000000  // which names the dimension
using Primitive = CGAL::AABB_triangle_primitive_3<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits_3<Kernel, Primitive>>;
#else
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
#endif

Kernel::Point_3 point_of(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

}  // namespace

struct ExactDepth::Impl {
  Triangles triangles;
  std::unique_ptr<Tree> tree;
};

ExactDepth::ExactDepth(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  for (const auto& [a, b, c] : mesh.faces) {
    impl_->triangles.emplace_back(point_of(mesh.vertices[a]), point_of(mesh.vertices[b]),
                                  point_of(mesh.vertices[c]));
  }
  impl_->tree = std::make_unique<Tree>(impl_->triangles.begin(), impl_->triangles.end());
}

ExactDepth::~ExactDepth() = default;

double ExactDepth::first_hit(const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& direction) const {
  const Kernel::Ray_3 ray(point_of(origin),
                          Kernel::Vector_3(direction.x(), direction.y(), direction.z()));
  const auto first = impl_->tree->first_intersected_primitive(ray);
  if (!first) return std::numeric_limits<double>::infinity();
  const Kernel::Triangle_3& triangle = **first;
  // The plane's own equation, in double: t = n · (a − o) / n · d.
  const Kernel::Vector_3 normal =
      CGAL::cross_product(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  return normal * (triangle[0] - ray.source()) / (normal * ray.to_vector());
}

}  // namespace organbake
