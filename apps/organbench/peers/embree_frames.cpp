// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/embree_frames.h"

#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>

#include "organbake/core/error.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr int kPacket = 8;

}  // namespace

struct EmbreeFrames::Impl {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  float* vertices = nullptr;
  std::vector<std::array<std::array<std::uint8_t, 3>, 3>> colors;  // of each face's corners, sRGB

  ~Impl() {
    rtcReleaseGeometry(geometry);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  void trace_row(int y, const Intrinsics& lens, const Eigen::Vector3f& eye,
                 const Eigen::Matrix3f& world_from_camera, Rgb8Image& picture) const;
};

EmbreeFrames::EmbreeFrames(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  if (mesh.colors.size() != mesh.vertices.size())
    throw BadDataError("the mesh to trace has no colours");
  Impl& m = *impl_;
  m.vertices = static_cast<float*>(rtcSetNewGeometryBuffer(m.geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                           RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                           mesh.vertices.size()));
  auto* faces = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(m.geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.faces.size()));
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    for (int k = 0; k < 3; ++k) m.vertices[3 * v + k] = static_cast<float>(mesh.vertices[v][k]);
  for (const Face& face : mesh.faces) {
    auto& corners = m.colors.emplace_back();
    for (int k = 0; k < 3; ++k) {
      *faces++ = face[k];
      for (int c = 0; c < 3; ++c) corners[k][c] = srgb8_from_linear(mesh.colors[face[k]][c]);
    }
  }
  rtcSetGeometryBuildQuality(m.geometry, RTC_BUILD_QUALITY_REFIT);
  rtcSetSceneFlags(m.scene, RTC_SCENE_FLAG_DYNAMIC);
  rtcCommitGeometry(m.geometry);
  rtcAttachGeometry(m.scene, m.geometry);
  rtcCommitScene(m.scene);
}

EmbreeFrames::~EmbreeFrames() = default;

void EmbreeFrames::draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                        Rgb8Image& picture) {
  Impl& m = *impl_;
  for (std::size_t v = 0; v < positions.size(); ++v)
    for (int k = 0; k < 3; ++k) m.vertices[3 * v + k] = static_cast<float>(positions[v][k]);
  rtcUpdateGeometryBuffer(m.geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(m.geometry);
  rtcCommitScene(m.scene);

  const Intrinsics& lens = view.camera.intrinsics;
  if (picture.width != lens.width || picture.height != lens.height)
    picture = Rgb8Image(lens.width, lens.height);
  const Eigen::Vector3f eye = view.camera.center_world_mm().cast<float>();
  const Eigen::Matrix3f turn = view.camera.camera_from_world.rotation.transpose().cast<float>();
  tbb::parallel_for(0, lens.height, [&](int y) { m.trace_row(y, lens, eye, turn, picture); });
}

void EmbreeFrames::Impl::trace_row(int y, const Intrinsics& lens, const Eigen::Vector3f& eye,
                                   const Eigen::Matrix3f& world_from_camera,
                                   Rgb8Image& picture) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  for (int x0 = 0; x0 < lens.width; x0 += kPacket) {
    alignas(32) int valid[kPacket];
    RTCRayHit8 packet;
    for (int i = 0; i < kPacket; ++i) {
      valid[i] = x0 + i < lens.width ? -1 : 0;
      const Eigen::Vector3f direction =
          world_from_camera *
          Eigen::Vector3f(static_cast<float>((x0 + i + 0.5 - lens.cx) / lens.fx),
                          static_cast<float>((y + 0.5 - lens.cy) / lens.fy), 1);
      packet.ray.org_x[i] = eye.x(), packet.ray.org_y[i] = eye.y(), packet.ray.org_z[i] = eye.z();
      packet.ray.dir_x[i] = direction.x(), packet.ray.dir_y[i] = direction.y();
      packet.ray.dir_z[i] = direction.z();
      packet.ray.tnear[i] = 1, packet.ray.tfar[i] = 1e9F, packet.ray.time[i] = 0;
      packet.ray.mask[i] = 0xFFFFFFFFu, packet.ray.flags[i] = 0;
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect8(valid, scene, &context, &packet);
    for (int i = 0; i < kPacket && x0 + i < lens.width; ++i) {
      std::uint8_t* pixel = picture.at(x0 + i, y);
      const bool hit = packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      for (int c = 0; c < 3; ++c) {
        pixel[c] = 0;
        if (!hit) continue;
        const auto& corner = colors[packet.hit.primID[i]];
        const float u = packet.hit.u[i], v = packet.hit.v[i];
        pixel[c] = static_cast<std::uint8_t>((1 - u - v) * corner[0][c] + u * corner[1][c] +
                                             v * corner[2][c] + 0.5F);
      }
    }
  }
}

}  // namespace organbake
