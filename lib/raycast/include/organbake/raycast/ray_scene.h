// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Rays and closest points against all faces of a mesh.

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

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
