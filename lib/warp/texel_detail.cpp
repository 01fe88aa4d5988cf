// SPDX-License-Identifier: Apache-2.0
#include "warp/texel_detail.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

// Beyond this many texel sizes of depth from one texel to the next (80.5° from facing) two texels
// count as two surfaces: their colours are not differenced.
constexpr float kSteepestTexels = 6;

std::uint8_t coded(float linear) {
  const float clamped = linear > 0 ? std::min(linear, 1.0f) : 0.0f;
  return static_cast<std::uint8_t>(255 * std::sqrt(clamped) + 0.5f);
}

std::int8_t to_int8(int value) { return static_cast<std::int8_t>(std::clamp(value, -127, 127)); }

// First difference and half the second difference of c between its neighbours: the parabola
// through all three where both are there, a straight line where one is.
struct Terms {
  std::int8_t first, half_second;
};
Terms terms(int before, int here, int after, bool has_before, bool has_after) {
  const auto halved = [](int twice) { return twice >= 0 ? (twice + 1) / 2 : -((1 - twice) / 2); };
  if (has_before && has_after) {
    return {to_int8(halved(after - before)), to_int8(halved(after - 2 * here + before))};
  }
  if (has_after) return {to_int8(after - here), 0};
  if (has_before) return {to_int8(here - before), 0};
  return {0, 0};
}

}  // namespace

MapNeighbours::MapNeighbours(const CameraMaps& maps, double focal_px)
    : maps_(maps), steepest_(kSteepestTexels / static_cast<float>(focal_px)) {
  coded_.resize(maps.color.size());
  for (std::size_t i = 0; i < coded_.size(); ++i) {
    if (maps.face[i] == kNoFace) continue;
    const Eigen::Vector3f& c = maps.color[i];
    coded_[i] = {
        coded(c.x()), coded(c.y()), coded(c.z()),
        static_cast<std::uint8_t>(255 * std::clamp(maps.confidence[i], 0.0f, 1.0f) + 0.5f)};
  }
}

bool MapNeighbours::joined(std::uint32_t a, std::uint32_t b) const {
  return maps_.face[b] != kNoFace && coded_[b][3] > 0 &&
         std::abs(maps_.depth_mm[a] - maps_.depth_mm[b]) <= steepest_ * maps_.depth_mm[a];
}

SameSurface MapNeighbours::same_surface(std::uint32_t texel) const {
  const std::uint32_t width = maps_.width, x = texel % width, y = texel / width;
  SameSurface same;
  same.left = x > 0 && joined(texel, texel - 1);
  same.right = x + 1 < width && joined(texel, texel + 1);
  same.up = y > 0 && joined(texel, texel - width);
  same.down = y + 1 < static_cast<std::uint32_t>(maps_.height) && joined(texel, texel + width);
  return same;
}

TexelDetail MapNeighbours::detail(std::uint32_t texel, const SameSurface& same) const {
  const auto& here = coded_[texel];
  const auto& left = coded_[same.left ? texel - 1 : texel];
  const auto& right = coded_[same.right ? texel + 1 : texel];
  const auto& up = coded_[same.up ? texel - maps_.width : texel];
  const auto& down = coded_[same.down ? texel + maps_.width : texel];
  TexelDetail detail{.red = here[0], .green = here[1], .blue = here[2], .confidence = here[3]};
  for (int k = 0; k < 3; ++k) {
    const Terms u = terms(left[k], here[k], right[k], same.left, same.right);
    const Terms v = terms(up[k], here[k], down[k], same.up, same.down);
    detail.along_u[k] = u.first, detail.curve_u[k] = u.half_second;
    detail.along_v[k] = v.first, detail.curve_v[k] = v.half_second;
  }
  return detail;
}

MapNeighbours::Slopes MapNeighbours::depth_slopes(std::uint32_t texel,
                                                  const SameSurface& same) const {
  const auto& z = maps_.depth_mm;
  const auto slope = [&](bool before, bool after, std::uint32_t stride) {
    const float first = before ? z[texel] - z[texel - stride] : 0;
    const float second = after ? z[texel + stride] - z[texel] : 0;
    return before && after ? 0.5f * (first + second) : first + second;
  };
  return {slope(same.left, same.right, 1), slope(same.up, same.down, maps_.width),
          same.left || same.right, same.up || same.down};
}

}  // namespace organbake
