// SPDX-License-Identifier: GPL-3.0-or-later
// The bake of a bundle's pictures. In: a surface with its colours, the proxy and the cameras. Out:
// maps, tile by tile (texel_tile.cpp), their confidence lowered at depth edges, and of the finished
// maps the base layer, a coarse coloured lattice over the proxy that is drawn where no camera sees.
//
// Tiles are shared out and each writes its own texels, so that bytes do not hang on threads.
#include "organbake/capture/capture.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <span>

#include "baking.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/shell.h"

namespace organbake {
namespace {

// Lines of the shell meet the surface both ways along each, past faces that turn away: the nearest
// meeting whose normal agrees counts.

using ShellLine = Lattice::ShellLine;

constexpr std::size_t kLinesAtOnce = 256;

// A stretch of lines, worked on together.
class LineBatch {
 public:
  LineBatch(std::span<const ShellLine> lines, std::span<RayHit> found, const TracedSurface& surface,
            double reach_mm)
      : lines_(lines), found_(found), surface_(surface), reach_mm_(reach_mm) {}

  void find() {
    cast(+1);
    cast(-1);
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (found_[i].face == kNoHit) take_closest(i);
    }
  }

 private:
  // Looks along all lines one way, past faces that turn away, and keeps what is nearer than the
  // find so far.
  void cast(int way) {
    // The surface may pass through the foot itself: start a little on the other side of it.
    const double behind = 1e-6 * reach_mm_;
    constexpr int kMostFacesPassed = 8;
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < lines_.size(); ++i) open.push_back(i);
    std::vector<double> from(lines_.size(), 0);
    for (int round = 0; round < kMostFacesPassed && !open.empty(); ++round) {
      std::vector<Ray> rays(open.size());
      std::vector<RayHit> hits(open.size());
      for (std::size_t k = 0; k < open.size(); ++k) {
        const ShellLine& line = lines_[open[k]];
        rays[k].direction = way * line.direction;
        rays[k].origin = line.foot - behind * rays[k].direction;
        rays[k].t_min = from[open[k]];
        rays[k].t_max = reach_mm_;
      }
      surface_.rays.first_hits(rays, hits);
      std::vector<std::size_t> still_open;
      for (std::size_t k = 0; k < open.size(); ++k) {
        if (hits[k].face == kNoHit) continue;
        if (surface_.normals.faces_against(hits[k].face, -lines_[open[k]].direction)) {
          keep_nearer(open[k], way * (hits[k].t - behind), hits[k]);
        } else {
          from[open[k]] = hits[k].t + behind;
          still_open.push_back(open[k]);
        }
      }
      open = std::move(still_open);
    }
  }

  void keep_nearer(std::size_t i, double height, RayHit hit) {
    if (found_[i].face != kNoHit && std::abs(found_[i].t) <= std::abs(height)) return;
    hit.t = height;
    found_[i] = hit;
  }

  void take_closest(std::size_t i) {
    const ShellLine& line = lines_[i];
    const ClosestPoint closest = surface_.rays.closest_point(line.foot);
    found_[i] = surface_.normals.hit_at(closest.face, closest.point);
    const double length2 = line.direction.squaredNorm();
    found_[i].t = length2 > 0 ? (closest.point - line.foot).dot(line.direction) / length2 : 0;
  }

  std::span<const ShellLine> lines_;
  std::span<RayHit> found_;
  const TracedSurface& surface_;
  double reach_mm_;
};

}  // namespace

double shell_reach_mm(const TriangleMesh& surface, const TriangleMesh& proxy) {
  constexpr std::size_t kProbes = 4000;
  constexpr double kRoom = 2.5;
  constexpr double kLeastShareOfSize = 1e-3;
  const RayScene proxy_scene(proxy);
  const std::size_t stride = std::max<std::size_t>(1, surface.vertices.size() / kProbes);
  const std::size_t probes = (surface.vertices.size() + stride - 1) / stride;
  std::vector<double> distances(probes);
  parallel_for(std::size_t{0}, probes, [&](std::size_t i) {
    distances[i] = proxy_scene.closest_point(surface.vertices[i * stride]).distance_mm;
  });
  return std::max(kRoom * *std::max_element(distances.begin(), distances.end()),
                  kLeastShareOfSize * bounds(proxy).diagonal());
}

std::vector<RayHit> shell_hits(const std::vector<ShellLine>& lines, const TracedSurface& surface,
                               double reach_mm, const RunContext& context) {
  std::vector<RayHit> hits(lines.size());
  const std::size_t batches = (lines.size() + kLinesAtOnce - 1) / kLinesAtOnce;
  parallel_for(std::size_t{0}, batches, [&](std::size_t b) {
    context.throw_if_cancelled();
    const std::size_t first = b * kLinesAtOnce;
    const std::size_t count = std::min(kLinesAtOnce, lines.size() - first);
    LineBatch(std::span(lines).subspan(first, count), std::span(hits).subspan(first, count),
              surface, reach_mm)
        .find();
  });
  return hits;
}

namespace {

using Eigen::Vector3d;
using ShellLine = Lattice::ShellLine;

constexpr std::size_t kMaxNodes = 1'000'000;
constexpr std::size_t kNodesAtOnce = 256;
constexpr std::size_t kMostCameras = 32;  // bits of seen_by

struct NodeValues {
  std::vector<double> height_mm;
  std::vector<Eigen::Vector3f> color;
  std::vector<std::uint32_t> seen_by;
};

// A camera sees a point when its map has that depth there, with confidence.
std::uint32_t seen_by(const BaseLayerScene& scene, const Vector3d& point) {
  constexpr float kSureConfidence = 0.5f;
  // Half a texel's diagonal off the texel's centre, on a surface seen at up to 70°.
  constexpr double kTexels = 2.5;
  std::uint32_t bits = 0;
  for (std::size_t c = 0; c < std::min(scene.cameras.size(), kMostCameras); ++c) {
    const PosedCamera& camera = scene.cameras[c];
    const CameraMaps& maps = scene.maps[c];
    const Vector3d in_camera = camera.camera_from_world * point;
    if (!(in_camera.z() > 0)) continue;
    const Eigen::Vector2d pixel = project(camera.intrinsics, in_camera);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < maps.width && pixel.y() < maps.height))
      continue;
    const auto texel = std::size_t(pixel.y()) * maps.width + std::size_t(pixel.x());
    const double tolerance = kTexels * in_camera.z() / camera.intrinsics.fx;
    if (maps.confidence[texel] > kSureConfidence &&
        std::abs(maps.depth_mm[texel] - in_camera.z()) <= tolerance)
      bits |= 1u << c;
  }
  return bits;
}

void bake_stretch(const BaseLayerScene& scene, std::span<const RayHit> hits, std::size_t first,
                  NodeValues& values) {
  std::vector<Vector3d> points(hits.size()), normals(hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    points[i] = scene.surface.normals.point(hits[i]);
    normals[i] = scene.surface.normals.at(hits[i]);
    values.height_mm[first + i] = hits[i].t;
    values.seen_by[first + i] = seen_by(scene, points[i]);
  }
  std::vector<Eigen::Vector3f> colors;
  scene.color.shade(points, normals, {hits.begin(), hits.end()}, colors);
  std::copy(colors.begin(), colors.end(), values.color.begin() + first);
}

NodeValues bake_nodes(const BaseLayerScene& scene, const std::vector<ShellLine>& lines,
                      const RunContext& context) {
  const std::vector<RayHit> hits = shell_hits(lines, scene.surface, scene.reach_mm, context);
  NodeValues values;
  values.height_mm.resize(lines.size());
  values.color.resize(lines.size());
  values.seen_by.resize(lines.size());
  const std::size_t batches = (lines.size() + kNodesAtOnce - 1) / kNodesAtOnce;
  parallel_for(std::size_t{0}, batches, [&](std::size_t b) {
    context.throw_if_cancelled();
    const std::size_t first = b * kNodesAtOnce;
    const std::size_t count = std::min(kNodesAtOnce, lines.size() - first);
    bake_stretch(scene, std::span(hits).subspan(first, count), first, values);
  });
  return values;
}

// Every node's height is where its shell line meets the surface, of all meetings the nearest to
// the proxy whose normal agrees; where there is none, the height of the closest surface point.
// Faces that share a vertex or an edge get the same values there, so the layer has no cracks.
BaseLayer bake_base_layer(const BaseLayerScene& scene, double step_mm, const RunContext& context) {
  const Lattice lattice(scene.proxy, lattice_steps(scene.proxy, step_mm, kMaxNodes));
  const NodeValues values = bake_nodes(scene, lattice.shell_lines(), context);

  BaseLayer layer;
  layer.steps = lattice.steps();
  layer.face_count = static_cast<std::uint32_t>(scene.proxy.faces.size());
  const std::size_t count = std::size_t(layer.face_count) * layer.nodes_per_face();
  layer.height_mm.reserve(count);
  layer.color.reserve(count);
  layer.seen_by.reserve(count);
  for (std::uint32_t face = 0; face < layer.face_count; ++face)
    each_node(layer.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t) {
      const std::uint32_t node = lattice.node(face, i, j);
      layer.height_mm.push_back(static_cast<float>(values.height_mm[node]));
      layer.color.push_back(values.color[node]);
      layer.seen_by.push_back(values.seen_by[node]);
    });
  return layer;
}

}  // namespace

namespace {

struct TileAddress {
  std::size_t camera;
  int left, top;
};

std::vector<TileAddress> all_tiles(const std::vector<PosedCamera>& cameras) {
  std::vector<TileAddress> tiles;
  for (std::size_t c = 0; c < cameras.size(); ++c)
    for (int top = 0; top < cameras[c].intrinsics.height; top += kTileSide)
      for (int left = 0; left < cameras[c].intrinsics.width; left += kTileSide)
        tiles.push_back({c, left, top});
  return tiles;
}

// Where a texel is a small part of the smallest spot, the mean over it is the colour at its centre.
int rays_needed(const PosedCamera& camera, const Bounds& surface, double detail_mm) {
  constexpr double kTexelsPerDetail = 4;
  const double distance = (camera.camera_from_world * surface.center()).norm();
  const double texel_mm = distance / std::min(camera.intrinsics.fx, camera.intrinsics.fy);
  return kTexelsPerDetail * texel_mm <= detail_mm ? 1 : 2;
}

void add_counts(const std::vector<TileCounts>& counts, CaptureResult& summary) {
  for (const TileCounts& tile : counts) {
    summary.bound_in_prism += tile.in_prism;
    summary.bound_by_fallback += tile.by_fallback;
    summary.unbound_texels += tile.unbound;
    summary.back_face_texels += tile.back_faces;
    summary.largest_height_mm = std::max(summary.largest_height_mm, tile.largest_height_mm);
  }
}

void capture_maps(const std::vector<CaptureScene>& scenes, const std::vector<PosedCamera>& cameras,
                  CaptureResult& summary, const RunContext& context) {
  for (const PosedCamera& camera : cameras)
    summary.maps.push_back(background_maps(camera.intrinsics.width, camera.intrinsics.height));
  const std::vector<TileAddress> tiles = all_tiles(cameras);
  std::vector<TileCounts> counts(tiles.size());
  std::atomic<std::size_t> done = 0;
  parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t t) {
    const auto [camera, left, top] = tiles[t];
    context.throw_if_cancelled();
    counts[t] = capture_tile(scenes[camera], cameras[camera], left, top, summary.maps[camera]);
    context.progress(0.9 * static_cast<double>(++done) / static_cast<double>(tiles.size()));
  });
  add_counts(counts, summary);
  std::vector<std::size_t> dropped(cameras.size());
  parallel_for(std::size_t{0}, cameras.size(), [&](std::size_t c) {
    dropped[c] = fade_at_edges(cameras[c].intrinsics, summary.maps[c]);
    lead_colors_beyond_outline(summary.maps[c]);
  });
  summary.unsure_texels = std::accumulate(dropped.begin(), dropped.end(), std::size_t{0});
}

// A shell has a place for every point, but of what lies far off it says nothing of use.
void check_together(const TriangleMesh& surface, const TriangleMesh& proxy) {
  const Bounds a = bounds(surface), b = bounds(proxy);
  const double apart_mm = (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(0).norm();
  const double size_mm = std::max(a.diagonal(), b.diagonal());
  if (apart_mm <= size_mm) return;
  throw BadDataError("the surface and the proxy lie " + to_text(apart_mm, 1) +
                     " mm apart, the larger is " + to_text(size_mm, 1) +
                     " mm: check that both show one organ in one coordinate system and unit");
}

std::size_t filled_texels(const std::vector<CameraMaps>& maps) {
  std::size_t filled = 0;
  for (const CameraMaps& one : maps)
    filled +=
        static_cast<std::size_t>(std::count_if(one.depth_mm.begin(), one.depth_mm.end(),
                                               [](float depth) { return std::isfinite(depth); }));
  return filled;
}

}  // namespace

void check_filled(const CaptureResult& captured, const std::string& surface) {
  const std::size_t filled = filled_texels(captured.maps), backs = captured.back_face_texels;
  const std::size_t seen =
      captured.bound_in_prism + captured.bound_by_fallback + captured.unbound_texels + backs;
  if (2 * backs > seen)
    throw BadDataError(surface + ": " + to_text(100.0 * double(backs) / double(seen), 0) +
                       " % of the texels that see it see it from behind, so it is open and wound "
                       "the wrong way round, or the cameras stand on its inner side; close it "
                       "('organbake repair', in a bake --repair auto), turn its faces round in a "
                       "mesh editor, or place the cameras before its outer side (place's "
                       "--cone-axis and --cone-angle-deg)");
  if (filled > 0) return;
  throw BadDataError(surface + ": all maps are empty, because " +
                     (seen == 0 ? "no camera sees it" : "the proxy can carry no texel of it") +
                     "; check that the surface, the proxy and the cameras are of one organ, in one "
                     "unit and in the "
                     "same axes (--unit, --space)");
}

void CaptureOptions::check() const {
  require(rays_per_texel_side >= 0 && rays_per_texel_side <= 16, "rays_per_texel_side",
          rays_per_texel_side,
          "take 1…16 (n × n rays are averaged for one texel), or 0: what is needed");
  require(base_step_mm >= 0.01 && base_step_mm <= 1000, "base_step_mm", base_step_mm,
          "take 0.01…1000 mm");
}

CaptureResult capture(const TracedSurface& surface, const TriangleMesh& proxy,
                      const std::vector<PosedCamera>& cameras, const SurfaceColor& color,
                      const CaptureOptions& options, const RunContext& context) {
  options.check();
  check_mesh(proxy, "proxy");
  if (proxy.empty()) throw BadDataError("proxy: no faces to bind to");
  if (cameras.empty()) throw BadDataError("cameras: none given, so there is nothing to capture");
  for (const PosedCamera& camera : cameras) check_camera(camera);
  check_together(surface.mesh, proxy);

  const double reach_mm = shell_reach_mm(surface.mesh, proxy);
  const ShellBinder shell(proxy, reach_mm);
  context.throw_if_cancelled();

  CaptureResult summary;
  const Bounds box = bounds(surface.mesh);
  std::vector<CaptureScene> scenes;
  for (const PosedCamera& camera : cameras) {
    const int side = options.rays_per_texel_side > 0 ? options.rays_per_texel_side
                                                     : rays_needed(camera, box, color.detail_mm());
    scenes.push_back({surface, shell, color, side});
  }
  capture_maps(scenes, cameras, summary, context);
  summary.base = bake_base_layer({proxy, surface, color, cameras, summary.maps, reach_mm},
                                 options.base_step_mm, context);
  context.progress(1);
  return summary;
}

}  // namespace organbake
