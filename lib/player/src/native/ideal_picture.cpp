// SPDX-License-Identifier: Apache-2.0
#include "ideal_picture.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/camera_shares.h"

namespace organbake {
namespace {

using Eigen::Vector3f;

// What one camera knows of a point.
struct Read {
  Vector3f color;
  float confidence;
};

// Weights of four texels, the point between the second and third at t (Catmull & Rom 1974).
std::array<float, 4> catmull_rom_weights(float t) {
  return {0.5f * t * (-1 + t * (2 - t)), 0.5f * (2 + t * t * (-5 + 3 * t)),
          0.5f * t * (1 + t * (4 - 3 * t)), 0.5f * t * t * (-1 + t)};
}

std::optional<Read> read_at(const CameraMaps& maps, const PosedCamera& camera,
                            const Eigen::Vector3d& world_mm) {
  constexpr double kSameSurfaceTexels = 6;
  const Eigen::Vector3d p = camera.camera_from_world * world_mm;
  if (p.z() <= 0) return std::nullopt;
  const Eigen::Vector2d pixel = project(camera.intrinsics, p);
  const double u = pixel.x() - 0.5, v = pixel.y() - 0.5;
  if (!(u >= 1 && v >= 1 && u < maps.width - 2 && v < maps.height - 2)) return std::nullopt;
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const auto wx = catmull_rom_weights(static_cast<float>(u - x)),
             wy = catmull_rom_weights(static_cast<float>(v - y));
  const double same_mm = kSameSurfaceTexels * p.z() / camera.intrinsics.fx;
  Read read{Vector3f::Zero(), 1};
  float sum = 0;
  for (int dy = -1; dy <= 2; ++dy) {
    for (int dx = -1; dx <= 2; ++dx) {
      const std::size_t i = std::size_t(y + dy) * maps.width + (x + dx);
      const bool inner = (dx == 0 || dx == 1) && (dy == 0 || dy == 1);
      const bool same = maps.face[i] != kNoFace && std::abs(maps.depth_mm[i] - p.z()) <= same_mm;
      if (inner && !same) return std::nullopt;
      if (inner) read.confidence = std::min(read.confidence, maps.confidence[i]);
      if (!same) continue;  // the outer ring may lie on other skin, and is left out
      const float w = wx[dx + 1] * wy[dy + 1];
      read.color += w * maps.color[i];
      sum += w;
    }
  }
  if (!(sum > 0.5f)) return std::nullopt;
  read.color = (read.color / sum).cwiseMax(0.0f);
  return read;
}

class Resampler {
 public:
  Resampler(const Bundle& bundle, const View& view)
      : bundle_(bundle),
        shares_(trimmed(view_weights(
            bundle.cameras.manifold,
            view.camera.center_world_mm() - bundle.cameras.manifold.center_world_mm))) {}

  std::optional<Vector3f> color(const Eigen::Vector3d& at_rest) const {
    Vector3f sum = Vector3f::Zero();
    float weight = 0;
    const auto add = [&](std::size_t c, float share) {
      const auto read = read_at(bundle_.maps[c], bundle_.cameras.cameras[c], at_rest);
      if (!read) return;
      sum += share * read->confidence * read->color;
      weight += share * read->confidence;
    };
    for (int i = 0; i < 3; ++i)
      if (shares_.weights[i] > 0) add(shares_.cameras[i], static_cast<float>(shares_.weights[i]));
    for (std::size_t c = 0; !(weight > 0) && c < bundle_.maps.size(); ++c) add(c, 1);
    if (!(weight > 0)) return std::nullopt;
    return sum / weight;
  }

 private:
  const Bundle& bundle_;
  ViewWeights shares_;
};

}  // namespace

Rgb8Image ideal_picture(const Bundle& bundle, const CarriedSurface& truth,
                        const std::vector<Eigen::Vector3d>& proxy_positions, const View& view,
                        const std::array<std::uint8_t, 3>& background) {
  const auto seen = truth.seen_at_centers(truth.carry(proxy_positions), view);
  const TriangleMesh& rest = truth.at_rest();
  const Resampler resampler(bundle, view);
  Rgb8Image picture(view.camera.intrinsics.width, view.camera.intrinsics.height);
  parallel_for(std::size_t{0}, seen.size(), [&](std::size_t i) {
    std::uint8_t* const rgb = &picture.pixels[3 * i];
    if (seen[i].face == kNoFace) {
      std::copy(background.begin(), background.end(), rgb);
      return;
    }
    const auto [a, b, c] = rest.faces[seen[i].face];
    const Vector3f own = (1 - seen[i].w1 - seen[i].w2) * rest.colors[a] +
                         seen[i].w1 * rest.colors[b] + seen[i].w2 * rest.colors[c];
    const Vector3f color = resampler.color(truth.point(seen[i], rest.vertices)).value_or(own);
    for (int k = 0; k < 3; ++k) rgb[k] = srgb8_from_linear(color[k]);
  });
  return picture;
}

}  // namespace organbake
