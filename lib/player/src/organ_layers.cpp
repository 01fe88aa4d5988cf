// SPDX-License-Identifier: Apache-2.0
#include "organ_layers.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/warp/front_edges.h"
#include "organbake/warp/outline.h"
#include "organbake/warp/skin_depth.h"

namespace organbake {
namespace {

void take_nearer(const Frame& layer, std::uint8_t organ, std::size_t begin, std::size_t end,
                 Frame& frame, std::vector<float>& depth_mm) {
  const bool shown = !frame.shown.empty() && !layer.shown.empty();
  const bool bound = !frame.bound.empty() && !layer.bound.empty();
  for (std::size_t i = begin; i < end; ++i) {
    if (!(layer.depth_mm[i] < depth_mm[i])) continue;
    depth_mm[i] = layer.depth_mm[i];
    frame.cover[i] = layer.cover[i];
    std::copy_n(layer.color.pixels.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                frame.color.pixels.begin() + static_cast<std::ptrdiff_t>(3 * i));
    if (shown) frame.shown[i] = layer.shown[i];
    if (bound) frame.bound[i] = layer.bound[i], frame.organ[i] = organ;
  }
}

void smooth_outlines(const std::vector<float>& depth_mm, float deeper_mm, Frame& frame) {
  const int width = frame.color.width, height = frame.color.height;
  float reach_mm = deeper_mm;
  for (const float depth : depth_mm)
    if (std::isfinite(depth)) reach_mm = std::max(reach_mm, depth);
  SkinDepth depth;
  depth.resize(width, height, reach_mm);
  std::vector<float> row(whole_vectors(width));
  for (int y = 0; y < height; ++y) {
    std::copy_n(&depth_mm[std::size_t(y) * width], width, row.begin());
    depth.put(0, y, width, row.data());
  }
  CoverMask skin;
  skin.read({0, 0, width, height}, frame);
  FrontEdges edges;
  edges.find(skin, depth, deeper_mm);
  Outline().soften(edges, frame);
}

}  // namespace

void join_layers(const std::vector<const Frame*>& layers, const DrawOptions& options,
                 float deeper_mm, Frame& frame) {
  const Frame& first = *layers.front();
  frame.color = first.color;
  frame.cover = first.cover;
  frame.shown = options.keep_shown ? first.shown : std::vector<Shown>{};
  frame.bound = options.keep_bound ? first.bound : std::vector<BoundPixel>{};
  frame.organ.assign(frame.bound.size(), 0);
  std::vector<float> depth_mm = first.depth_mm;
  constexpr std::size_t kGrain = 1 << 14;
  parallel_pieces(
      std::size_t{0}, depth_mm.size(), kGrain, [&](std::size_t first, std::size_t last) {
        for (std::size_t l = 1; l < layers.size(); ++l)
          take_nearer(*layers[l], static_cast<std::uint8_t>(l), first, last, frame, depth_mm);
      });
  if (options.smooth_outline) smooth_outlines(depth_mm, deeper_mm, frame);
  frame.depth_mm = options.keep_depth ? std::move(depth_mm) : std::vector<float>{};
}

DrawReport joined_report(const std::vector<DrawReport>& reports, bool unchanged) {
  DrawReport sum = reports.front();
  sum.unchanged = unchanged;
  for (std::size_t r = 1; r < reports.size(); ++r) {
    const DrawReport& more = reports[r];
    sum.tiles_drawn += more.tiles_drawn;
    sum.tiles_kept += more.tiles_kept;
    sum.samples_drawn += more.samples_drawn;
    sum.samples_facing_away += more.samples_facing_away;
    sum.samples_outside_view += more.samples_outside_view;
    sum.faces_drawn += more.faces_drawn;
    sum.faces_facing_away += more.faces_facing_away;
    sum.faces_outside_view += more.faces_outside_view;
    sum.base_triangles += more.base_triangles;
    sum.sample_pixels += more.sample_pixels;
    sum.base_pixels += more.base_pixels;
    sum.holes_before += more.holes_before;
    sum.holes_after += more.holes_after;
    sum.texel_mm = std::max(sum.texel_mm, more.texel_mm);
    sum.largest_stretch_px = std::max(sum.largest_stretch_px, more.largest_stretch_px);
    sum.times += more.times;
    sum.critical_path += more.critical_path;
  }
  return sum;
}

}  // namespace organbake
