// SPDX-License-Identifier: Apache-2.0
// The loops of optical flow over a row's pixels: where their skin lies in the other picture, and
// whether it is seen there. They have no branches, and their arrays do not overlap, so that
// compilers make vector code of them.
#include "flow_kernels.h"

#include <cmath>
#include <cstddef>

namespace organbake {
namespace {

[[gnu::always_inline]] inline bool finite(float value) {
  return std::abs(value) < std::numeric_limits<float>::infinity();
}

// How much the depth rises to a pixel beside; not a number where there is none.
[[gnu::always_inline]] inline float rise(const float* depth_mm, int at, int step, bool exists) {
  const float mm = depth_mm[at + step * int{exists}] - depth_mm[at];
  return exists ? mm : kNowhere;
}

// How the depth goes on from a pixel's centre to so much of a pixel behind it, with what that may
// be wrong by: as the pixel there has it, or, where the skin ends or hides other skin, as it came
// from the other side.
[[gnu::always_inline]] inline float reach(float way, float rise_before, float rise_behind,
                                          float pixel_mm) {
  constexpr float kBreak = 4, kBend = 0.35f, kOutline = 1.2f;  // of a slope, within a pixel
  const float there = way > 0 ? rise_behind : rise_before,
              back = way > 0 ? rise_before : rise_behind, share = std::abs(way);
  const bool breaks =
      !finite(there) | (std::abs(there) > kBreak * std::abs(back) + kBreak * pixel_mm);
  const float slope = finite(back) ? back : 0;
  const float as_it_came = kOutline * std::abs(slope) - share * slope,
              as_there = kBend * std::abs(there) + share * there;
  return breaks ? as_it_came : as_there;
}

[[gnu::always_inline]] inline bool lies_before(const ShownDepth& picture, float px, float py,
                                               float depth_mm, int x, int y) {
  const int at = y * picture.width + x;
  const float shown = picture.depth_mm[at], pixel_mm = shown * picture.pixel;
  const float u = px - (static_cast<float>(x) + 0.5f), v = py - (static_cast<float>(y) + 0.5f);
  const float left = rise(picture.depth_mm, at, -1, x > 0),
              right = rise(picture.depth_mm, at, 1, x + 1 < picture.width),
              up = rise(picture.depth_mm, at, -picture.width, y > 0),
              down = rise(picture.depth_mm, at, picture.width, y + 1 < picture.height);
  return finite(shown) & (depth_mm <= shown + reach(u, left, right, pixel_mm) +
                                          reach(v, up, down, pixel_mm) + 0.5f * pixel_mm);
}

}  // namespace

bool ShownDepth::before(float px, float py, float point_mm, int x, int y) const {
  return lies_before(*this, px, py, point_mm, x, y);
}

void place_points(const float* __restrict face, const float* __restrict b1,
                  const float* __restrict b2, const float* __restrict height_mm, unsigned count,
                  float* __restrict to) {
  const float c0 = face[0], c1 = face[4], c2 = face[8], c3 = face[12], c4 = face[16], c5 = face[20],
              c6 = face[24], c7 = face[28], c8 = face[32];
  const unsigned lanes = (count + kFlowLanes - 1) & ~(kFlowLanes - 1);
  for (unsigned i = 0; i < lanes; ++i) {
    const float u = b1[i], v = b2[i];
    to[i] =
        c0 + u * (c1 + u * c6 + v * c7) + v * (c2 + v * c8) + height_mm[i] * (c3 + u * c4 + v * c5);
  }
}

void project_points(const FlowLens& given, const std::int32_t* __restrict label,
                    const float* __restrict x, const float* __restrict y, const float* __restrict z,
                    unsigned count, float* __restrict px, float* __restrict py) {
  const FlowLens lens = given;
  for (unsigned i = 0; i < count; ++i) {
    const float inverse = 1 / z[i];
    const float to_x = lens.fx * x[i] * inverse + lens.cx,
                to_y = lens.fy * y[i] * inverse + lens.cy;
    const bool lands = (label[i] != 0) & (z[i] > lens.near_mm);
    px[i] = lands ? to_x : kNowhere;
    py[i] = lands ? to_y : kNowhere;
  }
}

void subtract_places(const float* __restrict x, const float* __restrict y,
                     const float* __restrict own_x, const float* __restrict own_y, unsigned count,
                     float* __restrict to) {
  for (unsigned i = 0; i < count; ++i) {
    const float by_x = x[i] - own_x[i], by_y = y[i] - own_y[i];
    const bool lands = x[i] == x[i];
    to[2 * std::size_t{i}] = lands ? by_x : 0;
    to[2 * std::size_t{i} + 1] = lands ? by_y : 0;
  }
}

namespace {

// Where points land in the picture, in whole pixels; the first one for those that land elsewhere.
struct Targets {
  alignas(64) std::int32_t x[kFlowSpan], y[kFlowSpan], inside[kFlowSpan];
};

void find_targets(const ShownDepth& picture, const float* __restrict x, const float* __restrict y,
                  unsigned count, Targets& to) {
  const auto width = static_cast<float>(picture.width), height = static_cast<float>(picture.height);
  for (unsigned i = 0; i < count; ++i) {
    const bool inside = (x[i] >= 0) & (y[i] >= 0) & (x[i] < width) & (y[i] < height);
    const float px = inside ? x[i] : 0, py = inside ? y[i] : 0;
    to.x[i] = static_cast<std::int32_t>(px);
    to.y[i] = static_cast<std::int32_t>(py);
    to.inside[i] = inside;
  }
}

// Skin that turns away arrives mirrored; what arrives squeezed is looked at closely.
void find_whole(const FlowPlaces& above, const FlowPlaces& row, const FlowPlaces& below,
                unsigned count, std::int32_t* __restrict whole) {
  constexpr float kSqueezed = 0.5f;
  const float *x = row.x, *y = row.y, *left_x = x - 1, *left_y = y - 1, *right_x = x + 1,
              *right_y = y + 1, *up_x = above.x, *up_y = above.y, *down_x = below.x,
              *down_y = below.y;
  const std::int32_t *label = row.label, *left_label = label - 1, *right_label = label + 1,
                     *up_label = above.label, *down_label = below.label;
  for (unsigned i = 0; i < count; ++i) {
    // Differences run from one neighbour to the other, of those that show the same label.
    const bool left = (left_label[i] == label[i]) & (left_x[i] == left_x[i]),
               right = (right_label[i] == label[i]) & (right_x[i] == right_x[i]),
               up = (up_label[i] == label[i]) & (up_x[i] == up_x[i]),
               down = (down_label[i] == label[i]) & (down_x[i] == down_x[i]);
    const float x0 = left_x[i], x1 = x[i], x2 = right_x[i], y0 = left_y[i], y1 = y[i],
                y2 = right_y[i], above_x = up_x[i], above_y = up_y[i], below_x = down_x[i],
                below_y = down_y[i];
    const float across_x = (right ? x2 : x1) - (left ? x0 : x1),
                across_y = (right ? y2 : y1) - (left ? y0 : y1),
                along_x = (down ? below_x : x1) - (up ? above_x : x1),
                along_y = (down ? below_y : y1) - (up ? above_y : y1);
    whole[i] = across_x * along_y - across_y * along_x > 4 * kSqueezed;
  }
}

}  // namespace

void find_seen(const ShownDepth& given, const FlowPlaces& above, const FlowPlaces& row,
               const FlowPlaces& below, const float* __restrict depth_mm, unsigned count,
               std::int32_t* __restrict answers) {
  const ShownDepth picture = given;
  Targets to;
  alignas(64) std::int32_t whole[kFlowSpan];
  find_targets(picture, row.x, row.y, count, to);
  find_whole(above, row, below, count, whole);
  const float *const x = row.x, *const y = row.y, *const shown = picture.depth_mm;
  for (unsigned i = 0; i < count; ++i) {
    const bool shows = finite(shown[to.y[i] * picture.width + to.x[i]]);
    const bool before = lies_before(picture, x[i], y[i], depth_mm[i], to.x[i], to.y[i]);
    const bool may = (to.inside[i] != 0) & (!shows | before);
    const int asks =
        kFlowSeen | (whole[i] != 0 ? 0 : kFlowMayTurnAway) | (shows ? 0 : kFlowBesideOutline);
    answers[i] = may ? asks : kFlowHidden;
  }
}

}  // namespace organbake
