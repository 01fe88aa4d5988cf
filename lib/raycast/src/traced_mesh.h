// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What RayScene's queries share.

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/face_queries.h"

namespace organbake {

// Embree 3 (Debian 12) and Embree 4 (Debian 13) under one name for what differs between them: how a
// query is told that its rays run together.

#if RTC_VERSION_MAJOR >= 4

inline void intersect(const int* valid, RTCScene scene, RTCRayHit8& rays, bool coherent) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  if (coherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &rays, &arguments);
}

inline void intersect(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, &ray); }

inline void find_occluded(const int* valid, RTCScene scene, RTCRay8& rays, bool coherent) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  if (coherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &rays, &arguments);
}

#else

inline RTCIntersectContext query_context(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

inline void intersect(const int* valid, RTCScene scene, RTCRayHit8& rays, bool coherent) {
  RTCIntersectContext context = query_context(coherent);
  rtcIntersect8(valid, scene, &context, &rays);
}

inline void intersect(RTCScene scene, RTCRayHit& ray) {
  RTCIntersectContext context = query_context(false);
  rtcIntersect1(scene, &context, &ray);
}

inline void find_occluded(const int* valid, RTCScene scene, RTCRay8& rays, bool coherent) {
  RTCIntersectContext context = query_context(coherent);
  rtcOccluded8(valid, scene, &context, &rays);
}

#endif

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
