// SPDX-License-Identifier: Apache-2.0
#include "drawing/tile_plan.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

// So many parts for each thread leave none idle for long at the end; more would place too many
// samples twice, for both of the parts that their chunk touches.
constexpr int kPartsPerThread = 2;
// Fewer items tell little of what one costs.
constexpr std::size_t kTellingItems = 64;
// Cuts lie where groups of pixels end that are lit together, and parts are no narrower.
constexpr int kCut_px = 2 * DirtyCells::kCell_px;

double share(const PixelBox& box, const PixelBox& of) {
  return double(box.width()) * box.height() / (double(of.width()) * of.height());
}

// The k-th of `pieces` cuts from `first` on to `last`.
int cut(int first, int last, int k, int pieces) {
  return k == pieces ? last : first + (last - first) * k / pieces / kCut_px * kCut_px;
}

}  // namespace

double TilePlan::ms_per_item(int tile) const {
  return ms_per_item_[tile] > 0 ? ms_per_item_[tile] : mean_ms_per_item_;
}

void TilePlan::list_tiles(const TileGrid& grid, DirtyCells& cells) {
  whole_.clear();
  for (int t = 0; t < grid.count(); ++t) {
    const PixelBox drawn = cells.within(grid.box(t));
    if (drawn.empty()) continue;
    TilePart& whole = whole_.emplace_back();
    whole.tile = t;
    whole.tile_box = grid.box(t);
    whole.drawn = whole.box = drawn;
  }
  tile_count_ = static_cast<int>(whole_.size());
}

void TilePlan::make(const TileGrid& grid, DirtyCells& cells, int threads,
                    const std::function<std::size_t(int)>& items_of) {
  list_tiles(grid, cells);
  items_.resize(grid.count());
  ms_per_item_.resize(grid.count(), 0);
  double sum = 0;
  for (TilePart& whole : whole_) {
    items_[whole.tile] = items_of(whole.tile);
    whole.cost = ms_per_item(whole.tile) * static_cast<double>(items_[whole.tile]) *
                 share(whole.drawn, whole.tile_box);
    sum += whole.cost;
  }
  parts_.clear();
  if (threads == 1) {
    parts_ = whole_;
    return;
  }
  const double most = std::max(sum / (kPartsPerThread * threads), 1e-9);
  for (const TilePart& whole : whole_) split(whole, static_cast<int>(std::ceil(whole.cost / most)));
  std::stable_sort(parts_.begin(), parts_.end(),
                   [](const TilePart& a, const TilePart& b) { return a.cost > b.cost; });
}

// Into up to six parts: across first, as a tile is wide.
void TilePlan::split(const TilePart& whole, int pieces) {
  const int rows = pieces >= 4 ? 2 : 1;
  const int columns = std::clamp((pieces + rows - 1) / rows, 1, 3);
  const PixelBox& all = whole.drawn;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      TilePart part = whole;
      part.box = {cut(all.x0, all.x1, column, columns), cut(all.y0, all.y1, row, rows),
                  cut(all.x0, all.x1, column + 1, columns), cut(all.y0, all.y1, row + 1, rows)};
      if (part.box.empty()) continue;
      part.cost *= share(part.box, all);
      parts_.push_back(part);
    }
  }
}

void TilePlan::learn() {
  double items = 0, ms = 0;
  std::vector<double> took(ms_per_item_.size(), 0);
  for (const TilePart& part : parts_) took[part.tile] += part.took_ms;
  for (const TilePart& whole : whole_) {
    if (items_[whole.tile] < kTellingItems) continue;
    const double drawn =
        static_cast<double>(items_[whole.tile]) * share(whole.drawn, whole.tile_box);
    ms_per_item_[whole.tile] = took[whole.tile] / drawn;
    items += drawn;
    ms += took[whole.tile];
  }
  if (items > 0 && ms > 0) mean_ms_per_item_ = ms / items;
}

}  // namespace organbake
