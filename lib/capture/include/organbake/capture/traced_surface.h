// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// A surface as rays see it, and the rays of a camera.

#include <Eigen/Core>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// Throws BadDataError naming the camera when its intrinsics or its pose cannot be used.
void check_camera(const PosedCamera& camera);

// Rays of one camera, z = 1 in camera space, so that a hit's t is its planar depth.
class CameraRays {
 public:
  explicit CameraRays(const PosedCamera& camera)
      : lens_(camera.intrinsics),
        eye_(camera.center_world_mm()),
        world_from_camera_(camera.camera_from_world.rotation.transpose()) {}

  Ray through(double x_px, double y_px) const {
    Ray ray;
    ray.origin = eye_;
    ray.direction = world_from_camera_ * unproject(lens_, {x_px, y_px});
    return ray;
  }
  // The coarser of the two axes: what one pixel spans at depth 1.
  double focal_px() const { return lens_.fx < lens_.fy ? lens_.fx : lens_.fy; }

 private:
  Intrinsics lens_;
  Eigen::Vector3d eye_;
  Eigen::Matrix3d world_from_camera_;
};

// A surface's normals and points at ray hits. Keeps a reference to the mesh.
class SmoothNormals {
 public:
  explicit SmoothNormals(const TriangleMesh& mesh);

  // Unit; interpolated from the vertices, so that shading does not show the faces.
  Eigen::Vector3d at(const RayHit& hit) const;
  // Whether the face itself, not its smooth normal, looks against the direction. False for a face
  // without area.
  bool faces_against(std::uint32_t face, const Eigen::Vector3d& direction) const {
    return face_normals_[face].dot(direction) < 0;
  }
  Eigen::Vector3d point(const RayHit& hit) const;
  // Whether a ray crosses the very face, and if so its hit.
  bool crosses(std::uint32_t face, const Ray& ray, RayHit& hit) const;
  // The hit that a ray would have had at a point of the face (t stays infinite).
  RayHit hit_at(std::uint32_t face, const Eigen::Vector3d& point) const;

 private:
  const TriangleMesh& mesh_;
  std::vector<Eigen::Vector3d> vertex_normals_;
  std::vector<Eigen::Vector3d> face_normals_;
};

// A surface with what every part of a capture asks of it, which takes longer to make than most of
// them. Keeps a reference to the mesh; a mesh is taken where one of these is wanted.
struct TracedSurface {
  // Throws BadDataError for a mesh that is broken or has no faces.
  TracedSurface(const TriangleMesh& surface);  // NOLINT: as its mesh is one

  const TriangleMesh& mesh;
  RayScene rays;
  SmoothNormals normals;
};

}  // namespace organbake
