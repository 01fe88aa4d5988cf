// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Rays and closest points, against one face and against all faces of a mesh.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
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

inline constexpr std::uint32_t kNoHit = 0xFFFFFFFFu;

// Distances are in units of |direction|, so a ray through (x, y, 1) of a camera gives planar depth.
// A ray with a NaN, an infinite origin or a zero direction hits nothing.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double t_min = 0;
  double t_max = std::numeric_limits<double>::infinity();
};

struct RayHit {
  std::uint32_t face = kNoHit;
  double t = std::numeric_limits<double>::infinity();  // recomputed in double from the face's plane
  float u = 0, v = 0;  // barycentric weights of corners 1 and 2, within 0…1
};

struct ClosestPoint {
  std::uint32_t face = kNoHit;  // the lowest index when several are equally near
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double distance_mm = std::numeric_limits<double>::infinity();
};

// One static triangle scene over Embree. Queries are const and thread-safe; batches are traced in
// packets of 8 in the order given and are not threaded inside, so callers split work by item.
// Watertight: no ray slips between faces that share corners. Embree searches in float about the
// mesh's centre, wherever that lies, with a margin of 4e-6 of the mesh's size; first_hits and
// closest_point then decide in double, so their answers depend neither on the other rays of the
// batch nor on the machine. occluded keeps the margin (a silhouette is that much larger).
// A ray that starts on the surface wants t_min to exceed the margin.
class RayScene {
 public:
  // Throws BadDataError for a mesh without faces, with bad indices or non-finite coordinates.
  explicit RayScene(const TriangleMesh& mesh);
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  // The spans must have equal lengths (std::invalid_argument otherwise).
  void first_hits(std::span<const Ray> rays, std::span<RayHit> hits) const;
  // occluded[i] = 1 when anything lies between t_min and t_max.
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;
  // face = kNoHit for a point that is not finite. A face that is likely to be near, as one that was
  // nearest before, makes the search quicker and changes nothing else.
  ClosestPoint closest_point(const Eigen::Vector3d& point,
                             std::uint32_t likely_face = kNoHit) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
