// SPDX-License-Identifier: Apache-2.0
#include "warp/base_drawing.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace organbake {
namespace {

// The three active cameras' bits of a node's seen_by, as a number 0…7.
std::uint32_t active_bits(std::uint32_t seen_by, const ViewWeights& weights) {
  std::uint32_t bits = 0;
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t camera = weights.cameras[i];
    if (camera < 32 && (seen_by >> camera & 1)) bits |= 1u << i;
  }
  return bits;
}

// Full weight where the cameras that see a node have no share in the view, none from kSeenEnough
// on, linear between: a leaving camera's skin fades into the base layer instead of vanishing.
std::array<float, 8> weight_table(const ViewWeights& weights) {
  constexpr double kSeenEnough = 0.1;
  std::array<float, 8> table{};
  for (std::uint32_t bits = 0; bits < 8; ++bits) {
    double share = 0;
    for (int i = 0; i < 3; ++i) share += bits >> i & 1 ? weights.weights[i] : 0;
    table[bits] = kBaseWeight * static_cast<float>(std::clamp(1 - share / kSeenEnough, 0.0, 1.0));
  }
  return table;
}

struct Node {
  RasterCorner corner;
  Eigen::Vector4f color_and_weight;
  bool visible = false;
};

PixelBox box_of(const std::array<RasterCorner, 3>& c, const View& view) {
  const auto [x0, x1] = std::minmax({c[0].x, c[1].x, c[2].x});
  const auto [y0, y1] = std::minmax({c[0].y, c[1].y, c[2].y});
  const double w = view.camera.intrinsics.width, h = view.camera.intrinsics.height;
  return {static_cast<int>(std::clamp(x0, 0.0, w)), static_cast<int>(std::clamp(y0, 0.0, h)),
          static_cast<int>(std::clamp(x1 + 1, 0.0, w)),
          static_cast<int>(std::clamp(y1 + 1, 0.0, h))};
}

}  // namespace

void BaseTile::clear(const PixelBox& tile) {
  box = tile;
  drawn = false;
  depth.assign(std::size_t(tile.width()) * tile.height(), std::numeric_limits<float>::infinity());
  for (auto* plane : {&red, &green, &blue, &weight}) plane->resize(depth.size());
}

BaseDrawing::BaseDrawing(const BaseLayer& layer) : layer_(layer) {
  const std::uint32_t nodes = layer_.nodes_per_face();
  seen_everywhere_.assign(layer_.face_count, ~0u);
  for (std::uint32_t f = 0; f < layer_.face_count; ++f) {
    for (std::uint32_t i = 0; i < nodes; ++i) {
      seen_everywhere_[f] &= layer_.seen_by[std::size_t(f) * nodes + i];
    }
  }
}

void BaseDrawing::add_face(std::uint32_t face, const FaceFrame& frame, bool whole, const View& view,
                           const std::array<float, 8>& weight_of, const ViewWeights& weights,
                           std::vector<BaseTriangle>& out) const {
  const std::uint32_t n = layer_.steps, nodes = layer_.nodes_per_face();
  const std::size_t first = std::size_t(face) * nodes;
  const Intrinsics& k = view.camera.intrinsics;
  std::vector<Node> placed(nodes);
  std::uint32_t index = 0;
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t j = 0; j <= n - i; ++j, ++index) {
      const float b1 = static_cast<float>(i) / static_cast<float>(n);
      const float b2 = static_cast<float>(j) / static_cast<float>(n);
      const float h = layer_.height_mm[first + index];
      float p[3];
      for (int r = 0; r < 3; ++r) {
        const auto& m = frame.metric[r];
        p[r] = m[0] + b1 * m[1] + b2 * m[2] + h * (m[3] + b1 * m[4] + b2 * m[5]);
      }
      Node& node = placed[index];
      node.visible = p[2] > view.near_mm;
      node.corner = {k.fx * p[0] / p[2] + k.cx, k.fy * p[1] / p[2] + k.cy, 1.0 / p[2]};
      const float weight =
          whole ? kBaseWeight : weight_of[active_bits(layer_.seen_by[first + index], weights)];
      node.color_and_weight << layer_.color[first + index], weight;
    }
  }
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Node &na = placed[a], &nb = placed[b], &nc = placed[c];
    if (!na.visible || !nb.visible || !nc.visible) return;
    const float most =
        std::max({na.color_and_weight[3], nb.color_and_weight[3], nc.color_and_weight[3]});
    BaseTriangle t{{na.corner, nb.corner, nc.corner},
                   {na.color_and_weight, nb.color_and_weight, nc.color_and_weight},
                   {}};
    if (most <= 0 || (!frame.two_sided && doubled_area(t.corners) >= 0)) return;
    t.box = box_of(t.corners, view);
    if (!t.box.empty()) out.push_back(t);
  };
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j + i < n; ++j) {
      const std::uint32_t here = base_node_index(n, i, j), below = base_node_index(n, i + 1, j);
      add(here, below, here + 1);
      if (i + j + 1 < n) add(below, below + 1, here + 1);
    }
  }
}

std::vector<BaseTriangle> BaseDrawing::triangles(const std::vector<FaceFrame>& faces,
                                                 const std::vector<std::uint8_t>& stretched,
                                                 const ViewWeights& weights,
                                                 const View& view) const {
  const std::array<float, 8> weight_of = weight_table(weights);
  std::vector<std::vector<BaseTriangle>> by_face(layer_.face_count);
  tbb::parallel_for(std::uint32_t{0}, layer_.face_count, [&](std::uint32_t f) {
    const bool whole = stretched[f] != 0 || faces[f].two_sided;
    if (!whole && weight_of[active_bits(seen_everywhere_[f], weights)] <= 0) return;
    add_face(f, faces[f], whole, view, weight_of, weights, by_face[f]);
  });
  std::vector<BaseTriangle> all;
  for (const auto& list : by_face) all.insert(all.end(), list.begin(), list.end());
  return all;
}

void draw_base(const std::vector<BaseTriangle>& triangles, std::span<const std::uint32_t> chosen,
               BaseTile& tile) {
  for (const std::uint32_t t : chosen) {
    const BaseTriangle& triangle = triangles[t];
    rasterise(triangle.corners, tile.box,
              [&](int x, int y, double depth, const std::array<double, 3>& w) {
                const std::size_t at = tile.at(x, y);
                if (!(depth < tile.depth[at])) return;
                const Eigen::Vector4f mixed =
                    triangle.color_and_weight[0] * static_cast<float>(w[0]) +
                    triangle.color_and_weight[1] * static_cast<float>(w[1]) +
                    triangle.color_and_weight[2] * static_cast<float>(w[2]);
                tile.depth[at] = static_cast<float>(depth);
                tile.red[at] = mixed[0], tile.green[at] = mixed[1], tile.blue[at] = mixed[2];
                tile.weight[at] = mixed[3];
                tile.drawn = true;
              });
  }
}

}  // namespace organbake
