// SPDX-License-Identifier: Apache-2.0
// Draws the original surface in a deformed state, as the truth that pictures from samples are
// judged by: each vertex carried by the shell map, 4×4 rays a pixel, drawn in bands of rows that
// stay in the cache.
#include "organbake/player/carried_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/rasteriser.h"

namespace organbake {
namespace {

constexpr int kRaysPerSide = TruthFrame::kRaysPerSide;
constexpr int kBandRows = 16;  // output rows that one task draws: their 4×4 rays stay in cache

// The nearest face of each pixel of a window, with its weights.
struct Hits {
  explicit Hits(std::size_t count)
      : depth(count, std::numeric_limits<float>::infinity()),
        face(count, kNoFace),
        weights(count) {}
  std::vector<float> depth;
  std::vector<std::uint32_t> face;
  std::vector<std::array<float, 2>> weights;  // of corners 1 and 2
};

// The ray that stands for a pixel's centre.
constexpr int kCentralRay = (kRaysPerSide / 2) * (kRaysPerSide + 1);

void draw_faces(const std::vector<SnappedTriangle>& faces, const PixelBox& window, Hits& hits) {
  draw_depths(faces, window, hits.depth,
              [&](std::size_t i, std::uint32_t f, const std::array<double, 3>& w) {
                hits.face[i] = f;
                hits.weights[i] = {static_cast<float>(w[1]), static_cast<float>(w[2])};
              });
}

}  // namespace

CarriedSurface::CarriedSurface(TriangleMesh surface, ShellSurface shell)
    : rest_(std::move(surface)), shell_(std::move(shell)) {
  check_mesh(rest_, "surface");
  if (rest_.faces.empty())
    throw BadDataError("surface: has no faces, there is no truth to compare with");
  const ShellBinder binder(shell_.at_rest(), shell_.reach_mm());
  bindings_.resize(rest_.vertices.size());
  parallel_for(std::size_t{0}, bindings_.size(),
               [&](std::size_t v) { bindings_[v] = binder.bind(rest_.vertices[v]); });
}

std::vector<Eigen::Vector3d> CarriedSurface::carry(
    const std::vector<Eigen::Vector3d>& proxy_positions) const {
  const std::vector<ShellMatrix> matrices = shell_.posed_matrices(proxy_positions);
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(bindings_.size());
  for (const ShellBinding& b : bindings_) {
    positions.push_back(shell_point(matrices[b.face], b.b1, b.b2, b.height_mm));
  }
  return positions;
}

std::vector<bool> CarriedSurface::visible(const std::vector<Eigen::Vector3d>& positions,
                                          const View& view) const {
  const Intrinsics& k = view.camera.intrinsics;
  const double scale = std::max(1.0, 1024.0 / std::min(k.width, k.height));
  const PixelBox picture{0, 0, static_cast<int>(std::ceil(scale * k.width)),
                         static_cast<int>(std::ceil(scale * k.height))};
  Hits hits(std::size_t(picture.width()) * picture.height());
  draw_faces(project_faces(rest_.faces, positions, view, scale), picture, hits);
  std::vector<bool> seen(positions.size(), false);
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const Eigen::Vector3d p = view.camera.camera_from_world * positions[v];
    if (p.z() < view.near_mm) continue;
    const Eigen::Vector2d pixel = scale * project(k, p);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < picture.x1 && pixel.y() < picture.y1))
      continue;
    const std::size_t i = std::size_t(pixel.y()) * picture.width() + std::size_t(pixel.x());
    // The depth picture is sampled at pixel centres: a slope of 4 within one of its pixels is seen.
    const double pixel_mm = p.z() / (k.fx * scale);
    seen[v] = p.z() <= hits.depth[i] + 4 * pixel_mm;
  }
  return seen;
}

std::vector<CarriedSurface::Seen> CarriedSurface::seen_at_centers(
    const std::vector<Eigen::Vector3d>& positions, const View& view) const {
  const Intrinsics& k = view.camera.intrinsics;
  Hits hits(std::size_t(k.width) * k.height);
  draw_faces(project_faces(rest_.faces, positions, view), {0, 0, k.width, k.height}, hits);
  std::vector<Seen> seen(hits.face.size());
  for (std::size_t i = 0; i < seen.size(); ++i)
    seen[i] = {hits.face[i], hits.weights[i][0], hits.weights[i][1]};
  return seen;
}

Eigen::Vector3d CarriedSurface::point(const Seen& seen,
                                      const std::vector<Eigen::Vector3d>& positions) const {
  const auto [a, b, c] = rest_.faces[seen.face];
  const double w1 = seen.w1, w2 = seen.w2;
  return (1 - w1 - w2) * positions[a] + w1 * positions[b] + w2 * positions[c];
}

TruthFrame CarriedSurface::draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                                const std::array<std::uint8_t, 3>& background) const {
  if (rest_.colors.empty())
    throw BadDataError("surface: has no colours, its picture cannot be drawn");
  const Intrinsics& k = view.camera.intrinsics;
  const auto faces = project_faces(rest_.faces, positions, view, kRaysPerSide);
  const auto& linear = linear_from_srgb8();
  const Eigen::Vector3f behind(linear[background[0]], linear[background[1]], linear[background[2]]);
  TruthFrame frame;
  frame.color = Rgb8Image(k.width, k.height);
  frame.sharp = frame.color;
  frame.covered.resize(std::size_t(k.width) * k.height);
  frame.shell_face.assign(frame.covered.size(), kNoFace);

  const auto color_at = [&](const Hits& hits, std::size_t i) -> Eigen::Vector3f {
    if (hits.face[i] == kNoFace) return behind;
    const auto [a, b, c] = rest_.faces[hits.face[i]];
    const auto [w1, w2] = hits.weights[i];
    return (1 - w1 - w2) * rest_.colors[a] + w1 * rest_.colors[b] + w2 * rest_.colors[c];
  };
  const int bands = (k.height + kBandRows - 1) / kBandRows;
  parallel_for(0, bands, [&](int band) {
    const int y0 = band * kBandRows, y1 = std::min(y0 + kBandRows, k.height);
    const PixelBox window{0, kRaysPerSide * y0, kRaysPerSide * k.width, kRaysPerSide * y1};
    Hits hits(std::size_t(window.width()) * window.height());
    draw_faces(faces, window, hits);
    for (int y = y0; y < y1; ++y) {
      for (int x = 0; x < k.width; ++x) {
        Eigen::Vector3f sum = Eigen::Vector3f::Zero(), central;
        const std::size_t pixel = std::size_t(y) * k.width + x;
        for (int ray = 0; ray < TruthFrame::kRaysPerPixel; ++ray) {
          const int rx = kRaysPerSide * x + ray % kRaysPerSide,
                    ry = kRaysPerSide * (y - y0) + ray / kRaysPerSide;
          const std::size_t i = std::size_t(ry) * window.width() + rx;
          const Eigen::Vector3f color = color_at(hits, i);
          sum += color;
          if (ray == kCentralRay) central = color;
          frame.covered[pixel] += hits.face[i] != kNoFace;
          if (ray == kCentralRay && hits.face[i] != kNoFace) {
            frame.shell_face[pixel] = bindings_[rest_.faces[hits.face[i]][0]].face;
          }
        }
        sum /= TruthFrame::kRaysPerPixel;
        for (int c = 0; c < 3; ++c) {
          frame.color.at(x, y)[c] = srgb8_from_linear(sum[c]);
          frame.sharp.at(x, y)[c] = srgb8_from_linear(central[c]);
        }
      }
    }
  });
  return frame;
}

}  // namespace organbake
