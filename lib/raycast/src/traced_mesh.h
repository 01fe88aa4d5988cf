// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "organbake/geometry/adjacency.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/face_queries.h"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace organbake {

struct ReleaseDevice {
  void operator()(RTCDeviceTy* device) const;
};
struct ReleaseScene {
  void operator()(RTCSceneTy* scene) const;
};

// What the queries of RayScene share: the mesh in the scene's frame, in double for answers and in
// Embree's tree for the search.
struct TracedMesh {
  explicit TracedMesh(const TriangleMesh& mesh);

  FaceCorners corners(std::uint32_t face) const {
    return {vertices[faces[face][0]], vertices[faces[face][1]], vertices[faces[face][2]]};
  }

  // local = scale · (world − center): bounds centred, half-size 1…2. A power of two, so that
  // scaling rounds nothing.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double scale = 1;
  double radius = 1;  // of a sphere round the origin that holds every face
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Face> faces;
  VertexFaces vertex_faces;
  std::unique_ptr<RTCDeviceTy, ReleaseDevice> device;
  std::unique_ptr<RTCSceneTy, ReleaseScene> scene;

 private:
  void place(const TriangleMesh& mesh);
  void build();
};

}  // namespace organbake
