// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// A pose as the solver moves it: rotations turn the object about its own centre, not about the
// camera, so that turning and shifting hardly trade against each other.
struct ObjectPose {
  Eigen::Quaterniond camera_from_world = Eigen::Quaterniond::Identity();  // unit
  Eigen::Vector3d center_camera_mm = Eigen::Vector3d::Zero();

  // Seven numbers for the solver: quaternion x, y, z, w, then the centre.
  std::array<double, 7> to_array() const;
  static ObjectPose from_array(const double* values);
};

ObjectPose object_pose(const RigidTransform& camera_from_world,
                       const Eigen::Vector3d& center_world_mm);
RigidTransform rigid_transform(const ObjectPose& pose, const Eigen::Vector3d& center_world_mm);

// A small motion (ω, τ), in radians and mm along the camera's axes:
//   x' = Exp(ω)(x − c) + c + τ,   c the object's centre.
using Motion = Eigen::Matrix<double, 6, 1>;
ObjectPose moved(const ObjectPose& pose, const Motion& motion);
// The motion from `from` to `to`: moved(from, result) = to.
Motion motion_between(const ObjectPose& from, const ObjectPose& to);

// d pixel / d (ω, τ) of an object point now at `point_camera_mm`.
Eigen::Matrix<double, 2, 6> pixel_motion(const Intrinsics& intrinsics,
                                         const Eigen::Vector3d& point_camera_mm,
                                         const Eigen::Vector3d& center_camera_mm);

// The same lens on an image reduced by `factor` (a power of two).
Intrinsics reduced(const Intrinsics& intrinsics, int factor);

// A point of the surface with its smooth unit normal (world, mm).
struct SurfaceSample {
  Eigen::Vector3d point, normal;
};

// What the borders of a mesh are.
enum class MeshBorders {
  unknown_beyond,  // the organ goes on there: a piece of it was segmented, or it was cut
  outlines,        // the organ ends there
};

// All that poses are sought for: the surface, its ray scene and what is fixed in its own space.
// Made once, then shared by all photographs and threads.
class RegisteredSurface {
 public:
  // Throws BadDataError for a mesh without faces or area, with bad indices or non-finite
  // coordinates.
  explicit RegisteredSurface(TriangleMesh mesh, MeshBorders borders = MeshBorders::unknown_beyond);

  const TriangleMesh& mesh() const { return mesh_; }
  const RayScene& scene() const { return scene_; }
  const Bounds& box() const { return box_; }
  const Eigen::Vector3d& center() const { return center_; }  // of the bounds; rotations turn there
  double radius_mm() const { return radius_; }               // farthest vertex from the centre
  // The same places whatever the pose: about evenly spread over the area, seeded.
  const std::vector<SurfaceSample>& samples() const { return samples_; }
  // How far the samples lie apart at two poses.
  double mean_distance_mm(const RigidTransform& a, const RigidTransform& b) const;

  // Whether the organ goes on beyond what the mesh shows of it.
  bool open() const { return !border_distance_mm_.empty(); }
  // How far along the surface a hit is from where it is cut; infinite where it is not open.
  float border_distance_mm(const RayHit& hit) const;

  struct Skin {
    Eigen::Vector3d normal;  // smooth, unit, towards the side that `direction` comes from
    float albedo = 1;        // luminance of the vertex colours; 1 without any
  };
  // What a ray along `direction` (world) sees at a hit.
  Skin skin(const RayHit& hit, const Eigen::Vector3d& direction) const;

 private:
  TriangleMesh mesh_;
  RayScene scene_;
  std::vector<Eigen::Vector3d> normals_;       // of vertices
  std::vector<Eigen::Vector3d> face_normals_;  // not normalised
  std::vector<float> border_distance_mm_;      // of vertices; empty when not open
  Bounds box_;
  Eigen::Vector3d center_;
  double radius_ = 0;
  std::vector<SurfaceSample> samples_;
};

// How far each vertex is from the mesh's border along its edges, in mm; nothing when the mesh has
// none. An edge is border when one face has it; corners at the very same place are one, so that
// triangles that don't share their vertices (STL) have no border between them.
std::vector<float> border_distance_mm(const TriangleMesh& mesh);

}  // namespace organbake
