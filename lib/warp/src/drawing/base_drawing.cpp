// SPDX-License-Identifier: Apache-2.0
// The base layer's lattice as triangles where a view needs it: its blocks are chosen, placed and
// rasterised.
#include "drawing/base_drawing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

#include "organbake/core/parallel.h"
#include "organbake/warp/draw_options.h"

namespace organbake {
namespace {

// What of a triangle lies behind the near plane (Sutherland & Hodgman 1974), in its order; corners
// are pixels × depth, and depth. visit(SnappedTriangle, weights_in) for each triangle of it;
// weights_in() turns weights of that one's corners into those of the whole one's.
template <class Visit>
void each_clipped(const std::array<Eigen::Vector3f, 3>& triangle, float near_mm,
                  const Visit& visit) {
  std::array<SnappedCorner, 4> corners;
  std::array<std::array<float, 3>, 4> shares;  // of the triangle's own
  int count = 0;
  const auto add = [&](const Eigen::Vector3f& at, float depth, const std::array<float, 3>& own) {
    shares[count] = own;
    corners[count++] = SnappedCorner({at.x() / depth, at.y() / depth, 1 / depth});
  };
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const Eigen::Vector3f &a = triangle[k], &b = triangle[next];
    std::array<float, 3> own{};
    own[k] = 1;
    if (a.z() > near_mm) add(a, a.z(), own);
    if ((a.z() > near_mm) == (b.z() > near_mm)) continue;
    const float t = (near_mm - a.z()) / (b.z() - a.z());
    own[k] = 1 - t, own[next] = t;
    add(a + t * (b - a), near_mm, own);
  }
  for (int k = 2; k < count; ++k)
    visit(SnappedTriangle(corners[0], corners[k - 1], corners[k]),
          [&](const std::array<float, 3>& part) {
            std::array<float, 3> whole;
            for (int i = 0; i < 3; ++i)
              whole[i] =
                  part[0] * shares[0][i] + part[1] * shares[k - 1][i] + part[2] * shares[k][i];
            return whole;
          });
}

}  // namespace

// A block's nodes in one frame, whole vectors of them.
struct BaseDrawing::PlacedBlock {
  static constexpr std::uint32_t kRow = kCells + 1, kNodes = 32, kCellNodes = 24;
  static_assert(kRow * kCells <= kCellNodes && kCellNodes + kRow + 1 <= kNodes);
  template <class Number>
  using PerNode = std::array<Number, kNodes>;

  const ShellColumns& matrix;
  const float to_edge;  // cells from its first to the lattice's long edge
  std::array<const Eigen::Vector3f*, kRow> color;  // by row, its first
  bool any_beyond = false;
  alignas(32) PerNode<float> weight, b1, b2, height_mm{}, inverse_depth;
  alignas(32) PerNode<std::int32_t> x, y;

  PlacedBlock(const BaseDrawing& base, const Block& block, const FaceFrame& frame, float near_mm)
      : matrix(frame.pixel), to_edge(static_cast<float>(base.layer_.steps - block.i - block.j)) {
    const BaseLayer& layer = base.layer_;
    const bool alike = block.seen_by.size() == 1;
    weight.fill(alike ? base.weight_of(block.seen_by.front()) : 0);
    for (std::uint32_t i = block.i; i <= base.block_end(block.i); ++i) {
      if (i + block.j > layer.steps) break;
      const std::uint32_t end = std::min(base.block_end(block.j), layer.steps - i) + 1;
      const std::size_t first = base.node(block.patch.face, i, block.j);
      const std::uint32_t k = (i - block.i) * kRow, count = end - block.j;
      color[i - block.i] = layer.color.data() + first;
      for (std::uint32_t j = 0; j < count; ++j) height_mm[k + j] = layer.height_mm[first + j];
      for (std::uint32_t j = 0; j < count && !alike; ++j)
        weight[k + j] = base.weight_of(layer.seen_by[first + j]);
    }
    place(block, 1 / static_cast<float>(layer.steps), near_mm);
  }

  // Of a cell's two triangles, by the cell's first node.
  static std::array<std::uint32_t, 3> corners(bool other, std::uint32_t cell) {
    return {cell + (other ? kRow : 0), cell + kRow + other, cell + 1};
  }
  // By a cell's first node a bit: whether its triangle may hold a pixel's centre of the box, faces
  // the eye (or both_sides) and has a corner that weighs (or any_weight). In a block with a node
  // beyond reach: all that weigh.
  std::uint32_t shown(bool other, const PixelBox& box, bool both_sides, bool any_weight) const {
    const auto [of_a, of_b, of_c] = corners(other, 0);
    const auto holds = [](std::int32_t a, std::int32_t b, std::int32_t c, int first, int end) {
      const std::int32_t low = std::min(std::min(a, b), c), high = std::max(std::max(a, b), c);
      return std::max(SnappedCorner::center_from(low), first) <=
             std::min(SnappedCorner::center_to(high), end - 1);
    };
    const auto product = [](std::int32_t p, std::int32_t q) {
      return static_cast<float>(p) * static_cast<float>(q);
    };
    std::uint32_t bits = 0;
#pragma GCC unroll 1
    for (std::uint32_t k = 0; k < kCellNodes; ++k) {
      const std::uint32_t a = k + of_a, b = k + of_b, c = k + of_c;
      // Rounded: what has hardly any area may be looked at for nothing.
      const float p = product(x[b] - x[a], y[c] - y[a]), q = product(x[c] - x[a], y[b] - y[a]);
      const bool faces = p - q <= 1e-6f * (std::abs(p) + std::abs(q));
      const bool in_box =
          holds(x[a], x[b], x[c], box.x0, box.x1) & holds(y[a], y[b], y[c], box.y0, box.y1);
      const bool weighs = (weight[a] > 0) | (weight[b] > 0) | (weight[c] > 0) | any_weight;
      const bool there = kPlaces[2][k] + (other ? 1.0f : 0.0f) < to_edge;
      const bool seen = ((in_box & (faces | both_sides)) | any_beyond) & weighs & there;
      bits |= std::uint32_t{seen} << k;
    }
    return bits;
  }
  // Pixels × depth, and depth.
  Eigen::Vector3f homogeneous(std::uint32_t at) const {
    return shell_point(matrix, b1[at], b2[at], height_mm[at]).head<3>();
  }
  // Colour and weight.
  BaseTile::Shade shade(std::uint32_t at) const {
    const Eigen::Vector3f& of = color[at / kRow][at % kRow];
    return {of[0], of[1], of[2], weight[at]};
  }
  // Before the near plane, or beyond reach.
  bool is_beyond(std::uint32_t at) const { return inverse_depth[at] < 0; }
  SnappedCorner corner(std::uint32_t at) const {
    SnappedCorner corner;
    corner.x = x[at], corner.y = y[at], corner.inverse_depth = inverse_depth[at];
    return corner;
  }

 private:
  // By node its row, its column and their sum, which no cell reaches where none begins. What fills
  // up the last vector repeats the last node.
  static constexpr std::array<PerNode<float>, 3> kPlaces = [] {
    std::array<PerNode<float>, 3> places{};
    for (std::uint32_t k = 0; k < kNodes; ++k) {
      const std::uint32_t node = std::min(k, kRow * kRow - 1), i = node / kRow, j = node % kRow;
      places[0][k] = static_cast<float>(i), places[1][k] = static_cast<float>(j);
      places[2][k] = i < kCells && j < kCells ? static_cast<float>(i + j) : 1e30f;
    }
    return places;
  }();

  // All at once, those beyond the lattice's long edge, too: one by one, as triangles ask for them,
  // takes longer.
  void place(const Block& block, float step, float near_mm) {
    const ShellColumns& m = matrix;
    const float reach = static_cast<float>(kRasterReach);
    const auto i = static_cast<float>(block.i), j = static_cast<float>(block.j);
    std::uint32_t beyond = 0;
    for (std::uint32_t k = 0; k < kNodes; ++k) {
      const float u = step * (i + kPlaces[0][k]), v = step * (j + kPlaces[1][k]);
      const auto row = [&](int r) {
        return m(r, 0) + u * (m(r, 1) + u * m(r, 6) + v * m(r, 7)) + v * (m(r, 2) + v * m(r, 8)) +
               height_mm[k] * (m(r, 3) + u * m(r, 4) + v * m(r, 5));
      };
      const float z = row(2), inverse = 1 / z, s = row(0) * inverse, t = row(1) * inverse;
      const bool in_reach = (z > near_mm) & (std::abs(s) < reach) & (std::abs(t) < reach);
      b1[k] = u, b2[k] = v;
      inverse_depth[k] = in_reach ? inverse : -1;
      x[k] = in_reach ? SnappedCorner::snapped(s) : 0;
      y[k] = in_reach ? SnappedCorner::snapped(t) : 0;
      beyond |= !in_reach;
    }
    any_beyond = beyond != 0;
  }
};

void BaseTile::clear(const PixelBox& tile, bool keep_bound) {
  box = tile;
  any_drawn = false;
  depth.clear();  // until one is drawn
  spans.clear(tile);
  shade.resize(std::size_t(tile.width()) * tile.height());
  bound.resize(keep_bound ? shade.size() : 0);
}

BaseDrawing::BaseDrawing(const BaseLayer& layer, const std::vector<ShellMatrix>& rest)
    : layer_(layer) {
  std::vector<Patch> patches;
  for (std::uint32_t f = 0; f < layer_.face_count; ++f) {
    for (std::uint32_t i = 0; i < layer_.steps; i += kCells) {
      for (std::uint32_t j = 0; i + j < layer_.steps; j += kCells) {
        blocks_.push_back(make_block(f, i, j, rest[f]));
        patches.push_back(blocks_.back().patch);
      }
    }
  }
  blocks_.shrink_to_fit();
  patches_ = PatchTable(patches);
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
  normals.reserve(2 * kCells * kCells);
  std::array<Eigen::Vector3d, (kCells + 1) * (kCells + 1)> points;
  const auto point = [&](std::uint32_t i, std::uint32_t j) -> Eigen::Vector3d& {
    return points[(i - i0) * PlacedBlock::kRow + j - j0];
  };
  const auto height = [&](std::uint32_t i, std::uint32_t j) {
    return layer_.height_mm[node(face, i, j)];
  };
  for (std::uint32_t i = i0; i <= block_end(i0); ++i) {
    for (std::uint32_t j = j0; j <= block_end(j0) && i + j <= n; ++j) {
      const Eigen::Array3f at(step * static_cast<float>(i), step * static_cast<float>(j),
                              height(i, j));
      low = low.min(at), high = high.max(at);
      point(i, j) = shell_point(rest, at[0], at[1], at[2]);
      const std::uint32_t seen_by = layer_.seen_by[node(face, i, j)];
      if (std::find(block.seen_by.begin(), block.seen_by.end(), seen_by) == block.seen_by.end())
        block.seen_by.push_back(seen_by);
    }
  }
  for (std::uint32_t i = i0; i < block_end(i0); ++i) {
    for (std::uint32_t j = j0; j < block_end(j0) && i + j < n; ++j) {
      slope += Eigen::Vector2f(height(i + 1, j), height(i, j + 1)) -
               Eigen::Vector2f::Constant(height(i, j));
      ++cells;
      const Eigen::Vector3d &p = point(i, j), &down = point(i + 1, j), &right = point(i, j + 1);
      normals.push_back((down - p).cross(right - p));
      if (i + j + 2 <= n) {
        const Eigen::Vector3d& across = point(i + 1, j + 1);
        normals.push_back((right - across).cross(down - across));
      }
    }
  }
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
  block.triangles = normals.size();
  return block;
}

float BaseDrawing::weight_of(std::uint32_t seen_by) const {
  const auto sees = [&](int i) { return std::uint64_t{seen_by} >> active_[i] & 1; };
  return weight_by_active_[sees(0) | sees(1) << 1 | sees(2) << 2];
}

void BaseDrawing::mark_moved(const PlacedFaces& faces, DirtyCells& cells) const {
  if (!faces.continued()) return;
  for (const Chosen& chosen : chosen_)
    if (faces.moved(chosen.face)) cells.mark(chosen.box);
}

void BaseDrawing::place(const PlacedFaces& faces, bool cut, const View& view, const TileGrid& grid,
                        DirtyCells& cells, VisibilitySummary& visibility, DrawReport& report) {
  // The layer knows of the first 32 cameras; no other sees a node.
  for (int i = 0; i < 3; ++i) active_[i] = std::min(report.weights.cameras[i], 32u);
  // Full weight where the cameras that see a node have no share in the view, none from kSeenEnough
  // on, linear between: a leaving camera's skin fades into the base layer instead of vanishing.
  for (std::uint32_t bits = 0; bits < 8; ++bits) {
    double share = 0;
    for (int i = 0; i < 3; ++i) share += bits >> i & 1 ? report.weights.weights[i] : 0;
    weight_by_active_[bits] =
        kBaseWeight * static_cast<float>(std::clamp(1 - share / kSeenEnough, 0.0, 1.0));
  }
  mark_moved(faces, cells);
  choose(faces, cut, view);
  mark_moved(faces, cells);
  for (const Chosen& chosen : chosen_) {
    visibility.box = united(visibility.box, chosen.box);
    visibility.shown[chosen.face] = 1;
    report.base_triangles += blocks_[chosen.block].triangles;
  }
  tiles_.build(grid, static_cast<std::uint32_t>(chosen_.size()),
               [this](std::uint32_t b) { return chosen_[b].box; });
}

// Pieces of the blocks at once, their choices one after the other.
void BaseDrawing::choose(const PlacedFaces& faces, bool cut, const View& view) {
  constexpr std::size_t kPiece = 4 * kPatchBatch;
  placed_.resize(blocks_.size());
  is_placed_.resize(blocks_.size(), 0);
  std::vector<std::vector<Chosen>> pieces((blocks_.size() + kPiece - 1) / kPiece);
  const auto choose_of = [&](std::size_t first, std::size_t end, std::vector<Chosen>& chosen) {
    bool placed = is_placed_[first] && !faces.any_moved(patches_, first, end);
    for (std::size_t b = first; b < end; ++b) {
      const std::uint32_t face = patches_.face(b);
      const std::vector<std::uint32_t>& seen_by = blocks_[b].seen_by;
      const bool weighing = std::any_of(seen_by.begin(), seen_by.end(),
                                        [&](std::uint32_t by) { return weight_of(by) > 0; });
      const bool near = faces[face].near, gaps = near || cut || faces[face].two_sided;
      if (!weighing && !gaps) continue;
      if (!std::exchange(placed, true))
        place_patches(patches_, first, static_cast<int>(end - first), faces.all(), view,
                      &placed_[first]);
      const ChunkFrame& frame = placed_[b];
      if (frame.visibility == ChunkVisibility::drawn)
        chosen.push_back({static_cast<std::uint32_t>(b), face, frame.box, weighing, gaps, near});
    }
    is_placed_[first] = placed;
  };
  parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t piece) {
    const std::size_t last = std::min((piece + 1) * kPiece, blocks_.size());
    for (std::size_t first = piece * kPiece; first < last; first += kPatchBatch)
      choose_of(first, std::min(last, first + kPatchBatch), pieces[piece]);
  });
  chosen_.clear();
  for (const std::vector<Chosen>& piece : pieces)
    chosen_.insert(chosen_.end(), piece.begin(), piece.end());
}

void BaseDrawing::draw(std::uint32_t number, const PlacedFaces& faces, const View& view,
                       float behind_mm, DrawnSamples& samples, BaseTile& tile) const {
  const Chosen& chosen = chosen_[number];
  if (intersected(chosen.box, tile.box).empty()) return;  // another part's
  const float farthest_mm = samples.farthest_mm(chosen.box);
  const bool fills = chosen.fills_gaps && !std::isfinite(farthest_mm);
  if (!chosen.weighs && !chosen.everywhere && !fills) return;
  if (placed_[chosen.block].nearest_mm > farthest_mm + behind_mm) return;
  const Block& block = blocks_[chosen.block];
  const FaceFrame& frame = faces[block.patch.face];
  const auto near_mm = static_cast<float>(view.near_mm);
  const PlacedBlock placed(*this, block, frame, near_mm);
  PixelBox drawn;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const bool weighs =
        chosen.everywhere || placed.weight[a] > 0 || placed.weight[b] > 0 || placed.weight[c] > 0;
    // weights_in: of a pixel's in the part of it that is drawn.
    const auto paint = [&](const SnappedTriangle& triangle, const auto& weights_in) {
      const PixelBox box = intersected(triangle.box, tile.box);
      if (box.empty() || (!frame.two_sided && triangle.doubled_area >= 0)) return;
      drawn = united(drawn, box);
      const BaseTile::Shade of_a = placed.shade(a), of_b = placed.shade(b), of_c = placed.shade(c);
      rasterise<float>(
          triangle, tile.box, [&](int x, int y, float depth, const std::array<float, 3>& part) {
            const std::size_t at = tile.at(x, y);
            if (!weighs && !samples.open(x, y)) return;
            if (!std::exchange(tile.any_drawn, true))
              tile.depth.assign(tile.shade.size(), std::numeric_limits<float>::infinity());
            if (!(depth < tile.depth[at])) return;
            const std::array<float, 3> w = weights_in(part);
            tile.depth[at] = depth;
            tile.shade[at] = w[0] * of_a + w[1] * of_b + w[2] * of_c;
            if (tile.bound.empty()) return;
            const auto mean = [&](const PlacedBlock::PerNode<float>& of) {
              return w[0] * of[a] + w[1] * of[b] + w[2] * of[c];
            };
            tile.bound[at] = {block.patch.face, mean(placed.b1), mean(placed.b2),
                              mean(placed.height_mm)};
          });
    };
    if (placed.is_beyond(a) || placed.is_beyond(b) || placed.is_beyond(c))
      return each_clipped({placed.homogeneous(a), placed.homogeneous(b), placed.homogeneous(c)},
                          near_mm, paint);
    paint(SnappedTriangle(placed.corner(a), placed.corner(b), placed.corner(c)), std::identity());
  };
  for (const bool other : {false, true}) {
    std::uint32_t cells =
        placed.shown(other, tile.box, frame.two_sided, chosen.everywhere || fills);
    for (; cells != 0; cells &= cells - 1) {
      const auto [a, b, c] = PlacedBlock::corners(other, std::countr_zero(cells));
      add(a, b, c);
    }
  }
  tile.spans.add(drawn);
}

}  // namespace organbake
