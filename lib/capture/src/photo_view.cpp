// SPDX-License-Identifier: GPL-3.0-or-later
// What a photograph sees of a surface and how far its colour is to be trusted. Occlusion is asked
// of a depth map of the photo's own view: a shadow ray's yes or no would leave a seam round every
// shadow. Where no photograph sees the surface, colours are carried on from where they are known,
// ring by ring over the mesh, then smoothed: a diffusion that needs no solver and gives the same
// colours in any order.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "baking.h"
#include "organbake/capture/solid_noise.h"
#include "organbake/capture/surface_color.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kLargestMap = 512;
constexpr double kGrazingCosine = 0.2, kFacingCosine = 0.4;
constexpr double kBorderShare = 0.08;
constexpr double kMixedTexels = 1.5, kClearTexels = 5;
// Depths agree up to this many texel widths: bumps within a texel and the map's interpolation.
constexpr double kSameDepthTexels = 2, kBehindTexels = 5;

// The four texels round a point: the first one's index, and how far the point lies to the right
// and below its centre. Both sides must be at least 2.
struct Footprint {
  std::size_t first;
  float right, down;

  Footprint(const Vector2d& at, int width, int height) {
    const double x = std::clamp(at.x() - 0.5, 0.0, width - 1.0);
    const double y = std::clamp(at.y() - 0.5, 0.0, height - 1.0);
    const int column = std::min(static_cast<int>(x), width - 2);
    const int row = std::min(static_cast<int>(y), height - 2);
    first = std::size_t(row) * width + column;
    right = static_cast<float>(x - column);
    down = static_cast<float>(y - row);
  }
  template <class Value>
  Value mix(const Value& a, const Value& b, const Value& below_a, const Value& below_b) const {
    const Value above = a + right * (b - a), below = below_a + right * (below_b - below_a);
    return above + down * (below - above);
  }
};

}  // namespace

PhotoView::PhotoView(Photo photo, const TracedSurface& surface)
    : photo_(std::move(photo)), eye_(photo_.camera.center_world_mm()) {
  const Intrinsics& lens = photo_.camera.intrinsics;
  check_camera(photo_.camera);
  if (lens.width < 2 || lens.height < 2)
    throw BadDataError("photo " + photo_.camera.name + ": narrower than 2 pixels");
  if (photo_.image.width != lens.width || photo_.image.height != lens.height)
    throw BadDataError("photo " + photo_.camera.name + ": its image is " +
                       std::to_string(photo_.image.width) + " × " +
                       std::to_string(photo_.image.height) + " pixels, its camera " +
                       std::to_string(lens.width) + " × " + std::to_string(lens.height) +
                       "; give the intrinsics of this very image");
  middle_depth_ = (bounds(surface.mesh).center() - eye_).norm();
  trace_depth(surface);
}

void PhotoView::trace_depth(const TracedSurface& surface) {
  const Intrinsics& lens = photo_.camera.intrinsics;
  map_per_pixel_ = std::min(1.0, double(kLargestMap) / std::max(lens.width, lens.height));
  map_width_ = std::max(2, static_cast<int>(std::lround(lens.width * map_per_pixel_)));
  map_height_ = std::max(2, static_cast<int>(std::lround(lens.height * map_per_pixel_)));
  const CameraRays camera_rays(photo_.camera);
  map_focal_px_ = camera_rays.focal_px() * map_per_pixel_;

  std::vector<float> depth(std::size_t(map_width_) * map_height_,
                           std::numeric_limits<float>::infinity());
  parallel_for(0, map_height_, [&](int y) {
    std::vector<Ray> rays(map_width_);
    std::vector<RayHit> hits(map_width_);
    for (int x = 0; x < map_width_; ++x)
      rays[x] = camera_rays.through((x + 0.5) / map_per_pixel_, (y + 0.5) / map_per_pixel_);
    surface.rays.first_hits(rays, hits);
    for (int x = 0; x < map_width_; ++x)
      if (hits[x].face != kNoHit && surface.normals.faces_against(hits[x].face, rays[x].direction))
        depth[std::size_t(y) * map_width_ + x] = static_cast<float>(hits[x].t);
  });
  const std::vector<float> distance =
      depth_edge_distance(depth, map_width_, map_height_, map_focal_px_, kClearTexels);
  map_.resize(depth.size());
  for (std::size_t i = 0; i < map_.size(); ++i)
    map_[i] = {depth[i], static_cast<float>(smooth_step(kMixedTexels, kClearTexels, distance[i]))};
}

double PhotoView::seen(const Vector2d& pixel, double depth) const {
  const Footprint at(pixel * map_per_pixel_, map_width_, map_height_);
  const Seen* above = &map_[at.first];
  const Seen* below = above + map_width_;
  const double clear = at.mix(above[0].clear, above[1].clear, below[0].clear, below[1].clear);
  if (!(clear > 0)) return 0;  // else all four depths are finite: next to background clear is 0
  const double mapped =
      at.mix(above[0].depth_mm, above[1].depth_mm, below[0].depth_mm, below[1].depth_mm);
  const double texels = std::abs(depth - mapped) * map_focal_px_ / mapped;
  return clear * (1 - smooth_step(kSameDepthTexels, kBehindTexels, texels));
}

// Blending happens in linear light; mixing sRGB codes would darken edges.
Vector3f PhotoView::linear_color(const Vector2d& pixel) const {
  static const std::array<float, 256>& linear = linear_from_srgb8();
  const Footprint at(pixel, photo_.image.width, photo_.image.height);
  const std::uint8_t* above = &photo_.image.pixels[3 * at.first];
  const std::uint8_t* below = above + 3 * std::size_t(photo_.image.width);
  Vector3f color;
  for (int c = 0; c < 3; ++c)
    color[c] =
        at.mix(linear[above[c]], linear[above[c + 3]], linear[below[c]], linear[below[c + 3]]);
  return color;
}

PhotoView::Look PhotoView::look_at_point(const Vector3d& point, const Vector3d& normal) const {
  const Vector3d to_eye = eye_ - point;
  const double distance2 = to_eye.squaredNorm(), toward = normal.dot(to_eye);
  if (!(toward > 0) || toward * toward < kGrazingCosine * kGrazingCosine * distance2) return {};
  const Intrinsics& lens = photo_.camera.intrinsics;
  const Vector3d in_camera = photo_.camera.camera_from_world * point;
  if (!(in_camera.z() > 0)) return {};
  const Vector2d pixel = project(lens, in_camera);
  const double border = std::min(std::min(pixel.x(), lens.width - pixel.x()) / lens.width,
                                 std::min(pixel.y(), lens.height - pixel.y()) / lens.height);
  if (!(border > 0)) return {};
  const double visible = seen(pixel, in_camera.z());
  if (!(visible > 0)) return {};

  const double cosine2 = toward * toward / distance2, nearness = middle_depth_ / in_camera.z();
  const double weight = cosine2 * smooth_step(kGrazingCosine, kFacingCosine, std::sqrt(cosine2)) *
                        smooth_step(0, kBorderShare, border) * visible * nearness * nearness;
  return {static_cast<float>(weight), linear_color(pixel)};
}

namespace {

using Eigen::Vector3f;

constexpr int kSmoothingRounds = 40;

Vector3f mean_of_known(const std::vector<char>& known, const std::vector<Vector3f>& colors) {
  Vector3f sum = Vector3f::Zero();
  std::size_t count = 0;
  for (std::size_t v = 0; v < colors.size(); ++v)
    if (known[v]) {
      sum += colors[v];
      ++count;
    }
  if (count == 0)
    throw BadDataError(
        "no photograph sees the surface: check that poses and surface share one frame (mm, LPS)");
  return sum / static_cast<float>(count);
}

}  // namespace

void flood_colors(const TriangleMesh& mesh, const std::vector<char>& known,
                  std::vector<Vector3f>& colors) {
  const Vector3f elsewhere = mean_of_known(known, colors);
  const VertexNeighbours neighbours(mesh.faces, mesh.vertices.size());
  std::vector<char> reached = known;
  std::vector<std::uint32_t> front, carried;
  for (std::uint32_t v = 0; v < known.size(); ++v)
    if (known[v]) front.push_back(v);

  // Ring by ring: a whole ring is coloured from the rings before it, so order does not matter.
  while (!front.empty()) {
    std::vector<std::uint32_t> ring;
    for (const std::uint32_t v : front)
      for (const std::uint32_t n : neighbours.of(v))
        if (!reached[n]) ring.push_back(n);
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    for (const std::uint32_t v : ring) {
      Vector3f sum = Vector3f::Zero();
      int count = 0;
      for (const std::uint32_t n : neighbours.of(v))
        if (reached[n]) {
          sum += colors[n];
          ++count;
        }
      colors[v] = sum / static_cast<float>(count);
    }
    for (const std::uint32_t v : ring) reached[v] = 1;
    carried.insert(carried.end(), ring.begin(), ring.end());
    front = std::move(ring);
  }
  for (std::size_t v = 0; v < colors.size(); ++v)
    if (!reached[v]) colors[v] = elsewhere;

  std::vector<Vector3f> next(carried.size());
  for (int round = 0; round < kSmoothingRounds; ++round) {
    for (std::size_t i = 0; i < carried.size(); ++i) {
      Vector3f sum = Vector3f::Zero();
      for (const std::uint32_t n : neighbours.of(carried[i])) sum += colors[n];
      next[i] = sum / static_cast<float>(neighbours.of(carried[i]).size());
    }
    for (std::size_t i = 0; i < carried.size(); ++i) colors[carried[i]] = next[i];
  }
}

}  // namespace organbake
