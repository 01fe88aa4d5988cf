// SPDX-License-Identifier: GPL-3.0-or-later
#include "exact_depth.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <limits>
#include <vector>

namespace organbake {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

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
