// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/embree_frames.h"

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "peers/embree_scene.h"

namespace organbake {
namespace {

constexpr int kPacket = 8;

}  // namespace

EmbreeFrames::EmbreeFrames(const TriangleMesh& mesh)
    : scene_(std::make_unique<EmbreeScene>(mesh, true)) {
  if (mesh.colors.size() != mesh.vertices.size())
    throw BadDataError("the mesh to trace has no colours");
  for (const Face& face : mesh.faces) {
    auto& corners = colors_.emplace_back();
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 3; ++c) corners[k][c] = srgb8_from_linear(mesh.colors[face[k]][c]);
  }
}

EmbreeFrames::~EmbreeFrames() = default;

void EmbreeFrames::draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                        Rgb8Image& picture) {
  scene_->write_vertices(positions);
  rtcUpdateGeometryBuffer(scene_->geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(scene_->geometry);
  rtcCommitScene(scene_->scene);
  const EmbreeLens lens(view.camera);
  const auto& [width, height] = std::pair(lens.intrinsics.width, lens.intrinsics.height);
  if (picture.width != width || picture.height != height) picture = Rgb8Image(width, height);
  parallel_for(0, picture.height, [&](int y) { trace_row(lens, y, picture); });
}

void EmbreeFrames::trace_row(const EmbreeLens& lens, int y, Rgb8Image& picture) const {
  for (int x0 = 0; x0 < picture.width; x0 += kPacket) {
    alignas(32) int valid[kPacket];
    RTCRayHit8 packet;
    for (int i = 0; i < kPacket; ++i) {
      valid[i] = x0 + i < picture.width ? -1 : 0;
      lens.set_ray(packet, i, x0 + i, y);
    }
    intersect_coherent(valid, scene_->scene, packet);
    for (int i = 0; i < kPacket && x0 + i < picture.width; ++i) {
      std::uint8_t* pixel = picture.at(x0 + i, y);
      const bool hit = packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      for (int c = 0; c < 3; ++c) {
        pixel[c] = 0;
        if (!hit) continue;
        const auto& corner = colors_[packet.hit.primID[i]];
        const float u = packet.hit.u[i], v = packet.hit.v[i];
        pixel[c] = static_cast<std::uint8_t>((1 - u - v) * corner[0][c] + u * corner[1][c] +
                                             v * corner[2][c] + 0.5F);
      }
    }
  }
}

}  // namespace organbake
