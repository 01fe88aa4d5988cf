// SPDX-License-Identifier: Apache-2.0
#include "warp/base_drawing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "warp/rasteriser.h"

namespace organbake {
namespace {

// Full weight where the cameras that see a node have no share in the view, none from kSeenEnough
// on, linear between: a leaving camera's skin fades into the base layer instead of vanishing.
// Indexed by which of the three active cameras see the node.
std::array<float, 8> weight_table(const ViewWeights& weights) {
  constexpr double kSeenEnough = 0.05;
  std::array<float, 8> table{};
  for (std::uint32_t bits = 0; bits < 8; ++bits) {
    double share = 0;
    for (int i = 0; i < 3; ++i) share += bits >> i & 1 ? weights.weights[i] : 0;
    table[bits] = kBaseWeight * static_cast<float>(std::clamp(1 - share / kSeenEnough, 0.0, 1.0));
  }
  return table;
}

}  // namespace

// A block's nodes in one frame, each placed when a triangle first asks for it: of most blocks along
// a silhouette a few triangles are drawn.
class BaseDrawing::PlacedBlock {
 public:
  struct Node {
    SnappedCorner corner;     // beyond reach if it lies before the near plane
    std::uint32_t index = 0;  // in the layer
    float b1 = 0, b2 = 0, weight = 0;
  };

  PlacedBlock(const BaseDrawing& base, const Chosen& chosen, const FaceFrame& frame,
              const View& view)
      : base_(base), block_(base.blocks_[chosen.block]), frame_(frame), view_(view) {
    weight_.fill(0);
    placed_.fill(false);
    if (!chosen.weighs) return;
    const std::uint32_t steps = base.layer_.steps;
    for (std::uint32_t i = block_.i; i <= base.block_end(block_.i); ++i) {
      for (std::uint32_t j = block_.j; j <= base.block_end(block_.j) && i + j <= steps; ++j) {
        const std::size_t node = base.node(block_.patch.face, i, j);
        weight_[at(i - block_.i, j - block_.j)] = base.weight_of(base.layer_.seen_by[node]);
      }
    }
  }

  static std::uint32_t at(std::uint32_t i, std::uint32_t j) { return i * (kCells + 1) + j; }
  float weight(std::uint32_t at) const { return weight_[at]; }
  const Node& node(std::uint32_t at) {
    if (!placed_[at]) place(at), placed_[at] = true;
    return nodes_[at];
  }

 private:
  void place(std::uint32_t at) {
    const std::uint32_t i = block_.i + at / (kCells + 1), j = block_.j + at % (kCells + 1);
    const float step = 1 / static_cast<float>(base_.layer_.steps);
    const Intrinsics& k = view_.camera.intrinsics;
    Node& out = nodes_[at];
    out.weight = weight_[at];
    out.index = static_cast<std::uint32_t>(base_.node(block_.patch.face, i, j));
    const float b1 = out.b1 = step * static_cast<float>(i);
    const float b2 = out.b2 = step * static_cast<float>(j);
    const float h = base_.layer_.height_mm[out.index];
    const ShellColumns& m = frame_.metric;
    const Eigen::Vector4f p =
        m.col(0) + b1 * m.col(1) + b2 * m.col(2) + h * (m.col(3) + b1 * m.col(4) + b2 * m.col(5));
    out.corner = {};
    if (!(p[2] > view_.near_mm)) return;
    const double inverse = 1 / static_cast<double>(p[2]);
    out.corner =
        SnappedCorner({k.fx * p[0] * inverse + k.cx, k.fy * p[1] * inverse + k.cy, inverse});
  }

  const BaseDrawing& base_;
  const Block& block_;
  const FaceFrame& frame_;
  const View& view_;
  // Those beyond the lattice's long edge are unused.
  static constexpr std::size_t kNodes = std::size_t(kCells + 1) * (kCells + 1);
  std::array<float, kNodes> weight_;
  std::array<bool, kNodes> placed_;
  std::array<Node, kNodes> nodes_;
};

void BaseTile::clear(const PixelBox& tile, bool keep_places) {
  box = tile;
  triangles = 0;
  depth.assign(std::size_t(tile.width()) * tile.height(), std::numeric_limits<float>::infinity());
  spans.clear(tile);
  shade.resize(depth.size());
  place.resize(keep_places ? depth.size() : 0);
}

BaseDrawing::BaseDrawing(const BaseLayer& layer, const std::vector<ShellMatrix>& rest)
    : layer_(layer) {
  for (std::uint32_t f = 0; f < layer_.face_count; ++f) {
    for (std::uint32_t i = 0; i < layer_.steps; i += kCells) {
      for (std::uint32_t j = 0; i + j < layer_.steps; j += kCells) {
        blocks_.push_back(make_block(f, i, j, rest[f]));
      }
    }
  }
}

// Bounds, mean slopes and normal cone of the block's cells, as a patch whose columns run along b2
// and rows along b1: v × u then points out of the surface.
BaseDrawing::Block BaseDrawing::make_block(std::uint32_t face, std::uint32_t i0, std::uint32_t j0,
                                           const ShellMatrix& rest) const {
  Block block;
  block.i = i0, block.j = j0;
  const std::uint32_t n = layer_.steps;
  const float step = 1 / static_cast<float>(n);
  Eigen::Array3f low = Eigen::Array3f::Constant(1e30f), high = -low;
  Eigen::Vector2f slope = Eigen::Vector2f::Zero();
  int cells = 0;
  std::vector<Eigen::Vector3d> normals;
  const auto height = [&](std::uint32_t i, std::uint32_t j) {
    return layer_.height_mm[node(face, i, j)];
  };
  const auto point = [&](std::uint32_t i, std::uint32_t j) {
    return shell_point(rest, step * static_cast<float>(i), step * static_cast<float>(j),
                       height(i, j));
  };
  for (std::uint32_t i = i0; i <= block_end(i0); ++i) {
    for (std::uint32_t j = j0; j <= block_end(j0) && i + j <= n; ++j) {
      const Eigen::Array3f at(step * static_cast<float>(i), step * static_cast<float>(j),
                              height(i, j));
      low = low.min(at), high = high.max(at);
      block.seen_by.push_back(layer_.seen_by[node(face, i, j)]);
      if (i == block_end(i0) || j == block_end(j0) || i + j == n) continue;
      slope += Eigen::Vector2f(height(i + 1, j), height(i, j + 1)) -
               Eigen::Vector2f::Constant(height(i, j));
      ++cells;
      const Eigen::Vector3d p = point(i, j), down = point(i + 1, j), right = point(i, j + 1);
      normals.push_back((down - p).cross(right - p));
      if (i + j + 2 <= n) {
        const Eigen::Vector3d across = point(i + 1, j + 1);
        normals.push_back((right - across).cross(down - across));
      }
    }
  }
  std::sort(block.seen_by.begin(), block.seen_by.end());
  block.seen_by.erase(std::unique(block.seen_by.begin(), block.seen_by.end()), block.seen_by.end());
  slope /= static_cast<float>(cells);
  Patch& patch = block.patch;
  patch.face = face;
  for (int k = 0; k < 3; ++k) {
    patch.center[k] = 0.5f * (low[k] + high[k]);
    patch.extent[k] = 0.5f * (high[k] - low[k]);
  }
  patch.along_v[0] = step, patch.along_v[2] = slope[0];
  patch.along_u[1] = step, patch.along_u[2] = slope[1];
  const Eigen::Vector3d mean = patch_normal(patch, rest);
  double smallest_cosine = 1;
  for (const Eigen::Vector3d& normal : normals) {
    smallest_cosine =
        std::min(smallest_cosine, normal.dot(mean) / std::max(1e-300, normal.norm() * mean.norm()));
  }
  patch.cone = NormalCone(static_cast<float>(std::acos(std::clamp(smallest_cosine, -1.0, 1.0))));
  return block;
}

float BaseDrawing::weight_of(std::uint32_t seen_by) const {
  std::uint32_t bits = 0;
  for (int i = 0; i < 3; ++i) {
    if (active_[i] < 32 && (seen_by >> active_[i] & 1)) bits |= 1u << i;
  }
  return weight_by_active_[bits];
}

bool BaseDrawing::weighs(const Block& block) const {
  return std::any_of(block.seen_by.begin(), block.seen_by.end(),
                     [&](std::uint32_t seen_by) { return weight_of(seen_by) > 0; });
}

void BaseDrawing::choose(const std::vector<FaceFrame>& faces,
                         const std::vector<std::uint8_t>& gappy, const ViewWeights& weights,
                         const View& view) {
  active_ = weights.cameras;
  weight_by_active_ = weight_table(weights);
  chosen_.clear();
  for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
    const Patch& patch = blocks_[b].patch;
    const bool weighing = weighs(blocks_[b]), gaps = gappy[patch.face] != 0;
    if (!weighing && !gaps) continue;
    const ChunkFrame placed = chunk_frame(patch, faces[patch.face], view);
    if (placed.fate == ChunkFate::drawn) chosen_.push_back({b, placed.box, weighing, gaps});
  }
}

void BaseDrawing::draw(std::uint32_t number, const std::vector<FaceFrame>& faces, const View& view,
                       const OpenPixels& open, BaseTile& tile) const {
  const Chosen& chosen = chosen_[number];
  const bool fills = chosen.fills_gaps && open.any(chosen.box);
  if (!chosen.weighs && !fills) return;
  const Block& block = blocks_[chosen.block];
  const FaceFrame& frame = faces[block.patch.face];
  PlacedBlock placed(*this, chosen, frame, view);
  const auto add = [&](std::uint32_t at_a, std::uint32_t at_b, std::uint32_t at_c) {
    const bool weighs =
        placed.weight(at_a) > 0 || placed.weight(at_b) > 0 || placed.weight(at_c) > 0;
    if (!weighs && !fills) return;
    const PlacedBlock::Node &a = placed.node(at_a), &b = placed.node(at_b), &c = placed.node(at_c);
    // Most triangles of the blocks round a silhouette face away.
    if (!frame.two_sided && doubled_area(a.corner, b.corner, c.corner) >= 0) return;
    const SnappedTriangle triangle(a.corner, b.corner, c.corner);
    const PixelBox box = intersected(triangle.box, tile.box);
    if (box.empty() || (!weighs && !open.any(box))) return;
    ++tile.triangles;
    tile.spans.add(box);
    rasterise(triangle, tile.box, [&](int x, int y, double depth, const std::array<double, 3>& w) {
      const std::size_t at = tile.at(x, y);
      if (!(depth < tile.depth[at]) || (!weighs && !open.at(x, y))) return;
      const Eigen::Vector3f w3(static_cast<float>(w[0]), static_cast<float>(w[1]),
                               static_cast<float>(w[2]));
      const Eigen::Vector3f color = w3[0] * layer_.color[a.index] + w3[1] * layer_.color[b.index] +
                                    w3[2] * layer_.color[c.index];
      tile.depth[at] = static_cast<float>(depth);
      tile.shade[at] = {color[0], color[1], color[2],
                        w3.dot(Eigen::Vector3f(a.weight, b.weight, c.weight))};
      if (!tile.keeps_places()) return;
      tile.place[at] = {block.patch.face, w3.dot(Eigen::Vector3f(a.b1, b.b1, c.b1)),
                        w3.dot(Eigen::Vector3f(a.b2, b.b2, c.b2))};
    });
  };
  const std::uint32_t n = layer_.steps;
  for (std::uint32_t i = 0; block.i + i < block_end(block.i); ++i) {
    for (std::uint32_t j = 0; block.j + j < block_end(block.j); ++j) {
      const std::uint32_t along = block.i + i + block.j + j;
      const auto at = PlacedBlock::at;
      if (along < n) add(at(i, j), at(i + 1, j), at(i, j + 1));
      if (along + 1 < n) add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
}

}  // namespace organbake
