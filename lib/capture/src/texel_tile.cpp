// SPDX-License-Identifier: GPL-3.0-or-later
// A tile of a map: rays through texel centres, their points bound in the shell, colours averaged
// over each texel. What is stored is rounded first and bound as it is stored, since the player sees
// the rounded depth. Confidence falls off towards grazing views and towards edges of the depth.
#include <algorithm>
#include <cmath>
#include <limits>

#include "baking.h"
#include "organbake/capture/solid_noise.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/image/grow.h"

namespace organbake {
namespace {

class EdgeDistances {
 public:
  EdgeDistances(int width, int height, double reach)
      : width_(width), height_(height), reach_(reach) {
    distance_.assign(std::size_t(width) * height, static_cast<float>(reach));
  }

  // An edge at (x, y) in pixels: few texels lie at edges, so visiting its disc is cheap.
  void mark(double x, double y) {
    const int left = std::max(0, static_cast<int>(x - reach_ - 0.5));
    const int right = std::min(width_ - 1, static_cast<int>(x + reach_));
    const int top = std::max(0, static_cast<int>(y - reach_ - 0.5));
    const int bottom = std::min(height_ - 1, static_cast<int>(y + reach_));
    for (int j = top; j <= bottom; ++j)
      for (int i = left; i <= right; ++i) {
        const double dx = i + 0.5 - x, dy = j + 0.5 - y;
        float& distance = distance_[std::size_t(j) * width_ + i];
        distance = std::min(distance, static_cast<float>(std::sqrt(dx * dx + dy * dy)));
      }
  }

  std::vector<float> take() { return std::move(distance_); }

 private:
  int width_, height_;
  double reach_;
  std::vector<float> distance_;
};

bool is_edge(float a, float b, double focal_px) {
  if (std::isinf(a) || std::isinf(b)) return std::isinf(a) != std::isinf(b);
  return std::abs(a - b) > kSteepestDepth * std::min(a, b) / focal_px;
}

}  // namespace

std::vector<float> depth_edge_distance(std::span<const float> depth_mm, int width, int height,
                                       double focal_px, double reach) {
  EdgeDistances distances(width, height, reach);
  const auto depth = [&](int x, int y) { return depth_mm[std::size_t(y) * width + x]; };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (x + 1 < width && is_edge(depth(x, y), depth(x + 1, y), focal_px))
        distances.mark(x + 1, y + 0.5);
      if (y + 1 < height && is_edge(depth(x, y), depth(x, y + 1), focal_px))
        distances.mark(x + 0.5, y + 1);
      if (std::isinf(depth(x, y))) continue;
      if (x == 0 || x + 1 == width) distances.mark(x == 0 ? 0 : width, y + 0.5);
      if (y == 0 || y + 1 == height) distances.mark(x + 0.5, y == 0 ? 0 : height);
    }
  std::vector<float> result = distances.take();
  for (std::size_t i = 0; i < result.size(); ++i)
    if (std::isinf(depth_mm[i])) result[i] = 0;
  return result;
}

namespace {

// A texel whose centre sees the surface.
struct CenterHit {
  int x, y;
  RayHit hit;
};

// Confidence by incidence: nothing at 80° from facing, where one texel covers six; all at 60°.
constexpr double kDarkCosine = 0.174, kSureCosine = 0.5;
// Confidence by the distance to a depth edge: all of it three texels away.
constexpr double kSureEdgeDistance = 3;

// Bits below these are noise of some thousandths of a texel and would not compress: a third of a
// map's bytes. Depth keeps 17 bits, 8·10⁻⁶ of itself; a height keeps a quarter of the depth's last
// one. Nobody sees a weight finer than 1/64.
constexpr int kDepthBits = 17, kHeightBits = 19;
constexpr float kConfidenceSteps = 64;
// How far from its texel's surface a rounded height may lead, of the depth: as far as the depth's
// last bit. Along a straight prism it is at most a quarter of that; where a body's prisms close,
// the way across the body.
constexpr double kHeightLeads = 1.0 / (1 << kDepthBits);

// `value` as a whole number of `bits` below the leading bit of `depth_mm` > 0.
float rounded_below(double depth_mm, int bits, double value) {
  int exponent = 0;
  std::frexp(depth_mm, &exponent);
  return static_cast<float>(
      std::ldexp(std::round(std::ldexp(value, bits - exponent)), exponent - bits));
}

// The confidence that the angle between surface and view allows.
float confidence_at(const CaptureScene& scene, const Ray& ray, const RayHit& hit) {
  const double cosine = -scene.surface.normals.at(hit).dot(ray.direction.normalized());
  return static_cast<float>(smooth_step(kDarkCosine, kSureCosine, cosine));
}

// Depth, face and height of texels that see the surface.
void store_texels(const CaptureScene& scene, const CameraRays& camera,
                  const std::vector<CenterHit>& centers, CameraMaps& maps, TileCounts& counts) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(centers.size());
  for (const CenterHit& center : centers) {
    // A player has the depth as it is stored, so that is what must be bound.
    const Ray ray = camera.through(center.x + 0.5, center.y + 0.5);
    const float depth = rounded_below(center.hit.t, kDepthBits, center.hit.t);
    maps.depth_mm[std::size_t(center.y) * maps.width + center.x] = depth;
    points.push_back(ray.origin + double(depth) * ray.direction);
  }
  std::vector<ShellBinding> bindings(points.size());
  scene.shell.bind(points, bindings);
  for (std::size_t i = 0; i < centers.size(); ++i) {
    const ShellBinding& bound = bindings[i];
    const std::size_t texel = std::size_t(centers[i].y) * maps.width + centers[i].x;
    const float height_mm = rounded_below(centers[i].hit.t, kHeightBits, bound.height_mm);
    const double within_mm = kHeightLeads * centers[i].hit.t;
    if (!scene.shell.gives_back(bound.face, height_mm, points[i], within_mm)) {
      maps.confidence[texel] = 0;
      ++counts.unbound;
      continue;
    }
    ++(scene.shell.inside(bound, points[i]) ? counts.in_prism : counts.by_fallback);
    counts.largest_height_mm = std::max(counts.largest_height_mm, std::abs(bound.height_mm));
    maps.face[texel] = bound.face;
    maps.height_mm[texel] = height_mm;
  }
}

// Points to be shaded together; those of one texel stand side by side.
struct ColorBatch {
  std::vector<Eigen::Vector3d> points, normals;
  std::vector<RayHit> hits;
  std::vector<std::size_t> texels;
  std::vector<Eigen::Vector3f> colors;

  void add(const SmoothNormals& surface, const Ray& ray, const RayHit& hit, std::size_t texel) {
    points.push_back(ray.origin + hit.t * ray.direction);
    normals.push_back(surface.at(hit));
    hits.push_back(hit);
    texels.push_back(texel);
  }

  void average_into(std::vector<Eigen::Vector3f>& map) const {
    for (std::size_t first = 0, last; first < texels.size(); first = last) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (last = first; last < texels.size() && texels[last] == texels[first]; ++last)
        sum += colors[last];
      map[texels[first]] = sum / static_cast<float>(last - first);
    }
  }
};

std::vector<Ray> rays_of(const std::vector<CenterHit>& centers, const CameraRays& camera,
                         int side) {
  std::vector<Ray> rays;
  rays.reserve(centers.size() * side * side);
  for (const CenterHit& center : centers)
    for (int row = 0; row < side; ++row)
      for (int column = 0; column < side; ++column)
        rays.push_back(
            camera.through(center.x + (column + 0.5) / side, center.y + (row + 0.5) / side));
  return rays;
}

// Most rays meet the very face that the texel's centre met; only the others search the scene.
std::vector<RayHit> trace(const CaptureScene& scene, const std::vector<CenterHit>& centers,
                          const std::vector<Ray>& rays) {
  const std::size_t rays_per_texel = rays.size() / centers.size();
  std::vector<RayHit> hits(rays.size());
  std::vector<std::size_t> open;
  std::vector<Ray> open_rays;
  for (std::size_t r = 0; r < rays.size(); ++r) {
    const std::uint32_t face = centers[r / rays_per_texel].hit.face;
    if (scene.surface.normals.crosses(face, rays[r], hits[r])) continue;
    open.push_back(r);
    open_rays.push_back(rays[r]);
  }
  std::vector<RayHit> open_hits(open.size());
  scene.surface.rays.first_hits(open_rays, open_hits);
  for (std::size_t i = 0; i < open.size(); ++i) hits[open[i]] = open_hits[i];
  return hits;
}

// Colours of such texels: the mean over n × n points spread over each texel. Rays that miss, or
// meet another surface than the texel's centre did, are left out: nothing bleeds across an outline.
void color_texels(const CaptureScene& scene, const CameraRays& camera,
                  const std::vector<CenterHit>& centers, CameraMaps& maps) {
  if (centers.empty()) return;
  const std::vector<Ray> rays = rays_of(centers, camera, scene.rays_per_side);
  const std::vector<RayHit> hits = trace(scene, centers, rays);
  const std::size_t rays_per_texel = rays.size() / centers.size();

  ColorBatch batch;
  for (std::size_t c = 0; c < centers.size(); ++c) {
    const RayHit& center = centers[c].hit;
    const std::size_t texel = std::size_t(centers[c].y) * maps.width + centers[c].x;
    const double one_surface = kSteepestDepth * center.t / camera.focal_px();
    const std::size_t before = batch.points.size();
    for (std::size_t r = c * rays_per_texel; r < (c + 1) * rays_per_texel; ++r)
      if (hits[r].face != kNoHit && std::abs(hits[r].t - center.t) <= one_surface &&
          scene.surface.normals.faces_against(hits[r].face, rays[r].direction))
        batch.add(scene.surface.normals, rays[r], hits[r], texel);
    if (batch.points.size() == before)  // a sliver thinner than the rays' spacing
      batch.add(scene.surface.normals, camera.through(centers[c].x + 0.5, centers[c].y + 0.5),
                center, texel);
  }
  scene.color.shade(batch.points, batch.normals, batch.hits, batch.colors);
  batch.average_into(maps.color);
}

}  // namespace

TileCounts capture_tile(const CaptureScene& scene, const PosedCamera& camera, int left, int top,
                        CameraMaps& maps) {
  const CameraRays camera_rays(camera);
  const int right = std::min(left + kTileSide, maps.width);
  const int bottom = std::min(top + kTileSide, maps.height);
  std::vector<Ray> rays;
  rays.reserve(std::size_t{kTileSide} * kTileSide);
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) rays.push_back(camera_rays.through(x + 0.5, y + 0.5));
  std::vector<RayHit> hits(rays.size());
  scene.surface.rays.first_hits(rays, hits);

  TileCounts counts;
  std::vector<CenterHit> centers;
  std::size_t next = 0;
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x, ++next) {
      if (hits[next].face == kNoHit) continue;
      if (!scene.surface.normals.faces_against(hits[next].face, rays[next].direction)) {
        ++counts.back_faces;
        continue;
      }
      const std::size_t texel = std::size_t(y) * maps.width + x;
      maps.confidence[texel] = confidence_at(scene, rays[next], hits[next]);
      // Texels without confidence have a depth, too, until fade_at_edges() has seen where the
      // surface is.
      maps.depth_mm[texel] = static_cast<float>(hits[next].t);
      if (maps.confidence[texel] > 0) centers.push_back({x, y, hits[next]});
    }
  store_texels(scene, camera_rays, centers, maps, counts);
  color_texels(scene, camera_rays, centers, maps);
  return counts;
}

std::size_t fade_at_edges(const Intrinsics& intrinsics, CameraMaps& maps) {
  std::size_t dropped = 0;
  const double focal = std::min(intrinsics.fx, intrinsics.fy);
  const std::vector<float> distance =
      depth_edge_distance(maps.depth_mm, maps.width, maps.height, focal, kSureEdgeDistance);
  for (std::size_t i = 0; i < distance.size(); ++i) {
    const auto from_edge = static_cast<float>(smooth_step(0, kSureEdgeDistance, distance[i]));
    const float confidence = maps.confidence[i] * from_edge;
    maps.confidence[i] = std::ceil(kConfidenceSteps * confidence) / kConfidenceSteps;
    if (maps.confidence[i] > 0 || !std::isfinite(maps.depth_mm[i])) continue;
    ++dropped;
    maps.depth_mm[i] = std::numeric_limits<float>::infinity();
    maps.color[i].setZero();
    maps.height_mm[i] = 0;
    maps.face[i] = kNoFace;
  }
  return dropped;
}

void lead_colors_beyond_outline(CameraMaps& maps) {
  constexpr int kRings = 4;
  std::vector<std::uint8_t> known(maps.color.size());
  for (std::size_t i = 0; i < known.size(); ++i) known[i] = maps.confidence[i] > 0;
  grow(maps.width, maps.height, kRings, known,
       [&](std::size_t texel, std::span<const std::size_t> beside) {
         Eigen::Vector3f sum = Eigen::Vector3f::Zero();
         for (const std::size_t other : beside) sum += maps.color[other];
         maps.color[texel] = sum / static_cast<float>(beside.size());
       });
}

}  // namespace organbake
