// SPDX-License-Identifier: GPL-3.0-or-later
// The bake: maps tile by tile, confidence by depth edges, the base layer from the finished maps.
// Tiles are shared out, each writes its own texels, so that bytes do not hang on threads.
#include "organbake/capture/capture.h"

#include <algorithm>
#include <atomic>
#include <numeric>

#include "base_layer_bake.h"
#include "organbake/capture/camera_rays.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/shell_binder.h"
#include "shell_hits.h"
#include "texel_tile.h"

namespace organbake {
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
    summary.maps.push_back(background_maps(camera.intrinsics));
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
  if (rays_per_texel_side < 0 || rays_per_texel_side > 16)
    throw UsageError("rays_per_texel_side = " + std::to_string(rays_per_texel_side) +
                     ": take 1…16 (n × n rays are averaged for one texel), or 0: what is needed");
  if (!(base_step_mm >= 0.01 && base_step_mm <= 1000))
    throw UsageError("base_step_mm = " + to_text(base_step_mm) + ": take 0.01…1000 mm");
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
