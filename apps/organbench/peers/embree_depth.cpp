// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/embree_depth.h"

#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

namespace organbake {
namespace {

constexpr int kPacketSide = 4;  // 4 × 4 texels: the most coherent packet of 16
constexpr int kPacketRays = kPacketSide * kPacketSide;

// A camera in float, as the packets want it.
struct Lens {
  explicit Lens(const PosedCamera& camera)
      : intrinsics(camera.intrinsics),
        eye(camera.center_world_mm().cast<float>()),
        world_from_camera(camera.camera_from_world.rotation.transpose().cast<float>()) {}

  Eigen::Vector3f direction(int x, int y) const {
    return world_from_camera *
           Eigen::Vector3f(static_cast<float>((x + 0.5 - intrinsics.cx) / intrinsics.fx),
                           static_cast<float>((y + 0.5 - intrinsics.cy) / intrinsics.fy), 1);
  }

  const Intrinsics& intrinsics;
  Eigen::Vector3f eye;
  Eigen::Matrix3f world_from_camera;
};

}  // namespace

struct EmbreeDepth::Impl {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);

  ~Impl() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  void trace_packet(const Lens& lens, int left, int top, std::vector<float>& depth_mm) const;
};

EmbreeDepth::EmbreeDepth(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               mesh.vertices.size()));
  auto* faces = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.faces.size()));
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    for (int k = 0; k < 3; ++k) *vertices++ = static_cast<float>(vertex[k]);
  for (const Face& face : mesh.faces) faces = std::copy(face.begin(), face.end(), faces);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(impl_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(impl_->scene);
}

EmbreeDepth::~EmbreeDepth() = default;

void EmbreeDepth::trace(const std::vector<PosedCamera>& cameras,
                        std::vector<std::vector<float>>& depths_mm) const {
  depths_mm.resize(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Lens lens(cameras[c]);
    const Intrinsics& size = lens.intrinsics;
    depths_mm[c].resize(std::size_t(size.width) * size.height);
    tbb::parallel_for(0, (size.height + kPacketSide - 1) / kPacketSide, [&](int row) {
      for (int left = 0; left < size.width; left += kPacketSide)
        impl_->trace_packet(lens, left, row * kPacketSide, depths_mm[c]);
    });
  }
}

void EmbreeDepth::Impl::trace_packet(const Lens& lens, int left, int top,
                                     std::vector<float>& depth_mm) const {
  const Intrinsics& size = lens.intrinsics;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) int valid[kPacketRays];
  RTCRayHit16 packet;
  for (int i = 0; i < kPacketRays; ++i) {
    const int x = left + i % kPacketSide, y = top + i / kPacketSide;
    valid[i] = x < size.width && y < size.height ? -1 : 0;
    const Eigen::Vector3f direction = lens.direction(x, y);
    packet.ray.org_x[i] = lens.eye.x();
    packet.ray.org_y[i] = lens.eye.y();
    packet.ray.org_z[i] = lens.eye.z();
    packet.ray.dir_x[i] = direction.x();
    packet.ray.dir_y[i] = direction.y();
    packet.ray.dir_z[i] = direction.z();
    packet.ray.tnear[i] = 0;
    packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
    packet.ray.time[i] = 0;
    packet.ray.mask[i] = 0xFFFFFFFFu;
    packet.ray.flags[i] = 0;
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
  rtcIntersect16(valid, scene, &context, &packet);
  for (int i = 0; i < kPacketRays; ++i) {
    if (valid[i] == 0) continue;
    const std::size_t texel =
        std::size_t(top + i / kPacketSide) * size.width + left + i % kPacketSide;
    depth_mm[texel] = packet.ray.tfar[i];  // stays infinite where nothing is hit
  }
}

}  // namespace organbake
