// SPDX-License-Identifier: GPL-3.0-or-later
//
// Costs of depths summed up with what neighbours ask for, along eight directions (semi-global
// matching, Hirschmüller 2008). In: a cost volume and the picture, whose edges let depth jump. Out:
// sums, of which the least at each pixel is its depth.
#include "view_depths.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace organbake {
namespace {

constexpr int kDirections = 4;  // in each of two passes over the picture
constexpr int kStep = 24;       // what a step to the next label costs, where a match costs 0…250
constexpr int kJump = 240;      // what a farther one costs, within one piece of tissue
constexpr float kEdge = 12;     // grey levels from one pixel to the next at which a jump costs half

// Path costs of one pixel: labels with a number too large to be chosen on either side.
class Paths {
 public:
  Paths(int width, int labels)
      : stride_(labels + 2), rows_(std::size_t(width) * kDirections * stride_, kFar) {
    least_.assign(std::size_t(width) * kDirections, 0);
  }
  std::uint16_t* at(int x, int direction) { return &rows_[slot(x, direction) * stride_ + 1]; }
  std::uint16_t& least(int x, int direction) { return least_[slot(x, direction)]; }

  static constexpr std::uint16_t kFar = 20000;

 private:
  static std::size_t slot(int x, int direction) { return std::size_t(x) * kDirections + direction; }
  std::size_t stride_;
  std::vector<std::uint16_t> rows_, least_;
};

// L(d) = C(d) + min(L'(d), L'(d ± 1) + step, min L' + jump) − min L'; returns the least L.
std::uint16_t follow(const std::uint8_t* __restrict cost, const std::uint16_t* __restrict before,
                     int least, int step, int jump, int labels, std::uint16_t* __restrict path,
                     std::uint16_t* __restrict sum) {
  std::uint16_t lowest = std::numeric_limits<std::uint16_t>::max();
  const auto by_jump = static_cast<std::uint16_t>(least + jump);
  const auto by_step = static_cast<std::uint16_t>(step), base = static_cast<std::uint16_t>(least);
  const std::uint16_t* __restrict under = before - 1, * __restrict over = before + 1;
  for (int d = 0; d < labels; ++d) {
    const std::uint16_t beside = under[d] < over[d] ? under[d] : over[d];
    const auto stepped = static_cast<std::uint16_t>(beside + by_step);
    std::uint16_t best = before[d] < stepped ? before[d] : stepped;
    best = best < by_jump ? best : by_jump;
    const auto here = static_cast<std::uint16_t>(cost[d] + best - base);
    path[d] = here;
    sum[d] = static_cast<std::uint16_t>(sum[d] + here);
    lowest = lowest < here ? lowest : here;
  }
  return lowest;
}

class Aggregation {
 public:
  Aggregation(const CostVolume& volume, const Plane& grey)
      : volume_(volume),
        grey_(grey),
        sums_(volume.costs.size()),
        before_(volume.width, volume.labels),
        now_(volume.width, volume.labels) {}

  std::vector<std::uint16_t> run() {
    pass(+1);
    pass(-1);
    return std::move(sums_);
  }

 private:
  // From the top left to the bottom right, or back: paths from the pixel before and from the three
  // of the row before.
  void pass(int way) {
    const int width = volume_.width, height = volume_.height;
    for (int j = 0; j < height; ++j) {
      const int y = way > 0 ? j : height - 1 - j;
      for (int i = 0; i < width; ++i) visit(way > 0 ? i : width - 1 - i, y, way);
      std::swap(before_, now_);
    }
  }

  void visit(int x, int y, int way) {
    const int dx[kDirections] = {-way, -way, 0, way}, dy[kDirections] = {0, -way, -way, -way};
    const std::uint8_t* cost = volume_.at(x, y);
    std::uint16_t* sum = &sums_[static_cast<std::size_t>(cost - volume_.costs.data())];
    for (int k = 0; k < kDirections; ++k) {
      const int fx = x + dx[k], fy = y + dy[k];
      const bool inside = fx >= 0 && fx < volume_.width && fy >= 0 && fy < volume_.height;
      Paths& from = dy[k] == 0 ? now_ : before_;
      if (!inside) {
        start(cost, x, k, sum);
        continue;
      }
      now_.least(x, k) =
          follow(cost, from.at(fx, k), from.least(fx, k), kStep,
                 jump(grey_.at(x, y), grey_.at(fx, fy)), volume_.labels, now_.at(x, k), sum);
    }
  }

  void start(const std::uint8_t* cost, int x, int k, std::uint16_t* sum) {
    std::uint16_t* path = now_.at(x, k);
    std::uint16_t lowest = CostVolume::kWorst;
    for (int d = 0; d < volume_.labels; ++d) {
      path[d] = cost[d];
      sum[d] = static_cast<std::uint16_t>(sum[d] + cost[d]);
      lowest = std::min<std::uint16_t>(lowest, cost[d]);
    }
    now_.least(x, k) = lowest;
  }

  // Depth jumps where brightness does.
  int jump(float here, float there) const {
    const float share = 1 / (1 + std::abs(here - there) / kEdge);
    return std::max(kStep + 1, static_cast<int>(kJump * share));
  }

  const CostVolume& volume_;
  const Plane& grey_;
  std::vector<std::uint16_t> sums_;
  Paths before_, now_;
};

}  // namespace

std::vector<std::uint16_t> aggregated(const CostVolume& volume, const Plane& grey) {
  return Aggregation(volume, grey).run();
}

}  // namespace organbake
