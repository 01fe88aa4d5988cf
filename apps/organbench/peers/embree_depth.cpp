// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/embree_depth.h"

#include "organbake/core/parallel.h"
#include "peers/embree_scene.h"

namespace organbake {
namespace {

constexpr int kPacketSide = 4;  // 4 × 4 texels: the most coherent packet of 16
constexpr int kPacketRays = kPacketSide * kPacketSide;

void trace_packet(RTCScene scene, const EmbreeLens& lens, int left, int top,
                  std::vector<float>& depth_mm) {
  const auto& [width, height] = std::pair(lens.intrinsics.width, lens.intrinsics.height);
  alignas(64) int valid[kPacketRays];
  RTCRayHit16 packet;
  for (int i = 0; i < kPacketRays; ++i) {
    const int x = left + i % kPacketSide, y = top + i / kPacketSide;
    valid[i] = x < width && y < height ? -1 : 0;
    lens.set_ray(packet, i, x, y);
  }
  intersect_coherent(valid, scene, packet);
  for (int i = 0; i < kPacketRays; ++i) {
    if (valid[i] == 0) continue;
    const std::size_t texel = std::size_t(top + i / kPacketSide) * width + left + i % kPacketSide;
    depth_mm[texel] = packet.ray.tfar[i];  // stays infinite where nothing is hit
  }
}

}  // namespace

EmbreeDepth::EmbreeDepth(const TriangleMesh& mesh)
    : scene_(std::make_unique<EmbreeScene>(mesh, false)) {}
EmbreeDepth::~EmbreeDepth() = default;

void EmbreeDepth::trace(const std::vector<PosedCamera>& cameras,
                        std::vector<std::vector<float>>& depths_mm) const {
  depths_mm.resize(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const EmbreeLens lens(cameras[c]);
    const Intrinsics& size = lens.intrinsics;
    depths_mm[c].resize(std::size_t(size.width) * size.height);
    parallel_for(0, (size.height + kPacketSide - 1) / kPacketSide, [&](int row) {
      for (int left = 0; left < size.width; left += kPacketSide)
        trace_packet(scene_->scene, lens, left, row * kPacketSide, depths_mm[c]);
    });
  }
}

}  // namespace organbake
