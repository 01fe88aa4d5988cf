// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bundle/base_layer.h"
#include "geometry/view_manifold.h"
#include "warp/draw_state.h"
#include "warp/rasteriser.h"
#include "warp/tile_grid.h"

namespace organbake {

// The base layer's weight where no active camera sees the skin; samples weigh camera × confidence.
inline constexpr float kBaseWeight = 0.03f;

// A lattice triangle that is to be drawn, Gouraud-shaded: linear colour and weight per corner.
struct BaseTriangle {
  std::array<RasterCorner, 3> corners;
  std::array<Eigen::Vector4f, 3> color_and_weight;
  PixelBox box;
};

// One tile's picture of the base layer; depth +inf where it is not drawn.
struct BaseTile {
  PixelBox box;
  bool drawn = false;
  std::vector<float> depth, red, green, blue, weight;

  void clear(const PixelBox& tile);
  std::size_t at(int x, int y) const {
    return std::size_t(y - box.y0) * box.width() + (x - box.x0);
  }
};

// Chooses, places and draws the parts of the base layer that a view needs.
class BaseDrawing {
 public:
  explicit BaseDrawing(const BaseLayer& layer);

  // The triangles with weight in this view, in order of their faces. crowded[f] ≠ 0 asks for face
  // f in full: its samples lie too far apart.
  std::vector<BaseTriangle> triangles(const std::vector<FaceFrame>& faces,
                                      const std::vector<std::uint8_t>& stretched,
                                      const ViewWeights& weights, const View& view) const;

 private:
  void add_face(std::uint32_t face, const FaceFrame& frame, bool whole, const View& view,
                const std::array<float, 8>& weight_of, const ViewWeights& weights,
                std::vector<BaseTriangle>& out) const;

  BaseLayer layer_;
  std::vector<std::uint32_t> seen_everywhere_;  // per face, bits of cameras that see all its nodes
};

void draw_base(const std::vector<BaseTriangle>& triangles, std::span<const std::uint32_t> chosen,
               BaseTile& tile);

}  // namespace organbake
