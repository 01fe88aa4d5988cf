// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/seams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "organbake/bundle/bundle.h"

namespace organbake {
namespace {

using Sum = std::array<double, 3>;

// Summed over pairs of pixels across one place.
struct ColorStep {
  Sum frame{}, truth{};
  std::size_t pairs = 0;
};

void add_difference(const std::uint8_t* a, const std::uint8_t* b, Sum& sum) {
  for (int c = 0; c < 3; ++c) sum[c] += double(b[c]) - double(a[c]);
}

void count_step(const ColorStep& step, SeamSteps& steps) {
  ++steps.places;
  for (int c = 0; c < 3; ++c) {
    const double frame = std::abs(step.frame[c]) / step.pairs,
                 truth = std::abs(step.truth[c]) / step.pairs;
    steps.frame = std::max(steps.frame, frame);
    steps.truth = std::max(steps.truth, truth);
    steps.excess = std::max(steps.excess, frame - truth);
  }
}

}  // namespace

SeamSteps edge_steps(const Rgb8Image& frame, const TruthFrame& truth) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, ColorStep> edges;
  const auto look = [&](int x, int y, int nx, int ny) {
    if (nx >= frame.width || ny >= frame.height) return;
    const std::size_t here = std::size_t(y) * frame.width + x,
                      there = std::size_t(ny) * frame.width + nx;
    std::uint32_t a = truth.shell_face[here], b = truth.shell_face[there];
    // A silhouette's pixel mixes in the background, which no proxy edge has made.
    if (truth.covered[here] < TruthFrame::kRaysPerPixel ||
        truth.covered[there] < TruthFrame::kRaysPerPixel) {
      return;
    }
    if (a == b || a == kNoFace || b == kNoFace) return;
    // From the lower face to the higher, wherever they lie.
    if (a > b) std::swap(a, b), std::swap(x, nx), std::swap(y, ny);
    ColorStep& edge = edges[{a, b}];
    ++edge.pairs;
    add_difference(frame.at(x, y), frame.at(nx, ny), edge.frame);
    add_difference(truth.sharp.at(x, y), truth.sharp.at(nx, ny), edge.truth);
  };
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      look(x, y, x + 1, y);
      look(x, y, x, y + 1);
    }
  }
  // At 35 dB a pixel is off by 4.5 levels, a pair by 6.4, the mean of 40 pairs by 1: half of the
  // two levels that a seam may add. Shorter edges say more of noise than of seams.
  constexpr std::size_t kFewestPairs = 40;
  SeamSteps steps;
  for (const auto& [faces, edge] : edges) {
    if (edge.pairs >= kFewestPairs) count_step(edge, steps);
  }
  return steps;
}

SeamSteps switch_steps(const Rgb8Image& before, const Rgb8Image& after,
                       const TruthFrame& truth_before, const TruthFrame& truth_after) {
  constexpr int kBlock = 8;
  SeamSteps steps;
  for (int y0 = 0; y0 + kBlock <= before.height; y0 += kBlock) {
    for (int x0 = 0; x0 + kBlock <= before.width; x0 += kBlock) {
      ColorStep block;
      for (int y = y0; y < y0 + kBlock; ++y) {
        for (int x = x0; x < x0 + kBlock; ++x) {
          const std::size_t i = std::size_t(y) * before.width + x;
          if (truth_before.covered[i] < TruthFrame::kRaysPerPixel ||
              truth_after.covered[i] < TruthFrame::kRaysPerPixel) {
            continue;
          }
          ++block.pairs;
          add_difference(before.at(x, y), after.at(x, y), block.frame);
          add_difference(truth_before.color.at(x, y), truth_after.color.at(x, y), block.truth);
        }
      }
      if (block.pairs == kBlock * kBlock) count_step(block, steps);
    }
  }
  return steps;
}

}  // namespace organbake
