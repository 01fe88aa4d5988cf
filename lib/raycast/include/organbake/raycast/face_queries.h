// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A triangle's corners by value: what the double-precision side of ray casting works on.
struct FaceCorners {
  Eigen::Vector3d a, b, c;
};

// Where a line meets a face's plane: origin + t·direction = a + u(b − a) + v(c − a). Not finite
// when the line runs in the plane or the face has no area.
struct PlaneCrossing {
  double t = 0, u = 0, v = 0;
  // All three corner weights above `margin`; false when anything is NaN.
  bool inside_by(double margin) const { return u > margin && v > margin && 1 - u - v > margin; }
};

// Cramer's rule on t·d − u·e1 − v·e2 = a − o (Möller & Trumbore 1997). Inline: it runs per ray.
inline PlaneCrossing cross_plane(const FaceCorners& face, const Eigen::Vector3d& origin,
                                 const Eigen::Vector3d& direction) {
  const Eigen::Vector3d e1 = face.b - face.a, e2 = face.c - face.a, to_face = face.a - origin;
  const Eigen::Vector3d normal = e1.cross(e2), r = to_face.cross(direction);
  const double inverse = 1 / direction.dot(normal);
  return {to_face.dot(normal) * inverse, e2.dot(r) * inverse, -e1.dot(r) * inverse};
}

// The face with its edges moved outward by `margin`, at most half as large again; a face without
// area stays as it is.
FaceCorners enlarged(const FaceCorners& face, double margin);

// The point of the face that lies nearest (Ericson 2005, 5.1.5); faces without area are treated
// as their longest edge, or as a point.
Eigen::Vector3d closest_on_face(const FaceCorners& face, const Eigen::Vector3d& point);

}  // namespace organbake
