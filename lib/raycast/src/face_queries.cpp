// SPDX-License-Identifier: GPL-3.0-or-later
// Rays and closest points against a single triangle in double precision, for what the search tree
// found in single precision.
#include "organbake/raycast/face_queries.h"

#include <algorithm>
#include <limits>

namespace organbake {
namespace {

Eigen::Vector3d closest_on_segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                   const Eigen::Vector3d& point) {
  const Eigen::Vector3d edge = b - a;
  const double length2 = edge.squaredNorm();
  if (!(length2 > 0)) return a;
  return a + std::clamp(edge.dot(point - a) / length2, 0.0, 1.0) * edge;
}

Eigen::Vector3d closest_on_outline(const FaceCorners& face, const Eigen::Vector3d& point) {
  const Eigen::Vector3d candidates[3] = {closest_on_segment(face.a, face.b, point),
                                         closest_on_segment(face.b, face.c, point),
                                         closest_on_segment(face.c, face.a, point)};
  return *std::min_element(std::begin(candidates), std::end(candidates),
                           [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
                             return (p - point).squaredNorm() < (q - point).squaredNorm();
                           });
}

}  // namespace

FaceCorners enlarged(const FaceCorners& face, double margin) {
  const double la = (face.c - face.b).norm(), lb = (face.a - face.c).norm(),
               lc = (face.b - face.a).norm(), perimeter = la + lb + lc;
  const double double_area = (face.b - face.a).cross(face.c - face.a).norm();
  if (!(double_area > 0)) return face;
  const double growth = std::min(0.5, margin * perimeter / double_area);  // margin over inradius
  const Eigen::Vector3d incenter = (la * face.a + lb * face.b + lc * face.c) / perimeter;
  const auto moved = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return p + growth * (p - incenter);
  };
  return {moved(face.a), moved(face.b), moved(face.c)};
}

Eigen::Vector3d closest_on_face(const FaceCorners& face, const Eigen::Vector3d& point) {
  const Eigen::Vector3d ab = face.b - face.a, ac = face.c - face.a, ap = point - face.a;
  const double ab_ap = ab.dot(ap), ac_ap = ac.dot(ap);
  const double ab_ab = ab.squaredNorm(), ac_ac = ac.squaredNorm(), ab_ac = ab.dot(ac);
  // Weights of the projection onto the plane, times the squared double area.
  const double area2 = ab_ab * ac_ac - ab_ac * ab_ac;
  const double b = ac_ac * ab_ap - ab_ac * ac_ap;
  const double c = ab_ab * ac_ap - ab_ac * ab_ap;
  const double a = area2 - b - c;
  // Needles, whose weights are rounding noise, go to their outline, which is right for them too.
  constexpr double kLeastSine2 = 1e-12;
  if (!(area2 > kLeastSine2 * ab_ab * ac_ac)) return closest_on_outline(face, point);
  if (a >= 0 && b >= 0 && c >= 0) return face.a + (b / area2) * ab + (c / area2) * ac;
  // Outside: on an edge that the projection lies beyond; beyond two, on either.
  const bool beyond[3] = {c < 0, a < 0, b < 0};  // of edges ab, bc, ca
  const Eigen::Vector3d* corner[4] = {&face.a, &face.b, &face.c, &face.a};
  Eigen::Vector3d best = face.a;
  double best2 = std::numeric_limits<double>::infinity();
  for (int edge = 0; edge < 3; ++edge) {
    if (!beyond[edge]) continue;
    const Eigen::Vector3d p = closest_on_segment(*corner[edge], *corner[edge + 1], point);
    const double distance2 = (p - point).squaredNorm();
    if (distance2 < best2) {
      best = p;
      best2 = distance2;
    }
  }
  return best;
}

}  // namespace organbake
