// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>  // Debian 13
#else
#include <embree3/rtcore.h>
#endif

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// One mesh as Embree has it, and rays through the pixels of a camera.
struct EmbreeScene {
  // moves: its vertices will be rewritten, its tree refitted.
  EmbreeScene(const TriangleMesh& mesh, bool moves);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  void write_vertices(const std::vector<Eigen::Vector3d>& positions);

  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  float* vertices = nullptr;
};

// A camera in float, as packets want it. It must be free of distortion.
struct EmbreeLens {
  explicit EmbreeLens(const PosedCamera& camera)
      : intrinsics(camera.intrinsics),
        eye(camera.center_world_mm().cast<float>()),
        world_from_camera(camera.camera_from_world.rotation.transpose().cast<float>()) {}

  // The i-th ray of a packet: through the middle of a pixel, planar depth 1 a unit of length.
  template <class Packet>
  void set_ray(Packet& packet, int i, int x, int y) const {
    const Eigen::Vector3f direction =
        world_from_camera *
        Eigen::Vector3f(static_cast<float>((x + 0.5 - intrinsics.cx) / intrinsics.fx),
                        static_cast<float>((y + 0.5 - intrinsics.cy) / intrinsics.fy), 1);
    packet.ray.org_x[i] = eye.x(), packet.ray.org_y[i] = eye.y(), packet.ray.org_z[i] = eye.z();
    packet.ray.dir_x[i] = direction.x(), packet.ray.dir_y[i] = direction.y();
    packet.ray.dir_z[i] = direction.z();
    packet.ray.tnear[i] = 0, packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
    packet.ray.time[i] = 0, packet.ray.mask[i] = 0xFFFFFFFFu, packet.ray.flags[i] = 0;
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }

  const Intrinsics& intrinsics;
  Eigen::Vector3f eye;
  Eigen::Matrix3f world_from_camera;
};

inline void intersect(const int* valid, RTCScene scene, RTCRayHit8& rays, auto* mode) {
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect8(valid, scene, &rays, mode);
#else
  rtcIntersect8(valid, scene, mode, &rays);
#endif
}

inline void intersect(const int* valid, RTCScene scene, RTCRayHit16& rays, auto* mode) {
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect16(valid, scene, &rays, mode);
#else
  rtcIntersect16(valid, scene, mode, &rays);
#endif
}

// Rays that run together; Embree 3 and 4 differ in how they are told so.
void intersect_coherent(const int* valid, RTCScene scene, auto& rays) {
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments mode;
  rtcInitIntersectArguments(&mode);
  mode.flags = RTC_RAY_QUERY_FLAG_COHERENT;
#else
  RTCIntersectContext mode;
  rtcInitIntersectContext(&mode);
  mode.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
#endif
  intersect(valid, scene, rays, &mode);
}

}  // namespace organbake
