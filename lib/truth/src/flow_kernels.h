// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

namespace organbake {

// The loops over a row's pixels that flow takes (flow.cpp): plain, over arrays of numbers that do
// not overlap, so that they run by vectors. A place that is not a number is none.

inline constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
inline constexpr unsigned kFlowLanes = 8, kFlowSpan = 128;

// shell_point() along one axis for points of one face, whose matrix has its columns four numbers
// apart: `face` is the first of that axis. By whole vectors: what it writes beyond the last point
// means nothing.
void place_points(const float* face, const float* b1, const float* b2, const float* height_mm,
                  unsigned count, float* to);

struct FlowLens {
  float fx, fy, cx, cy, near_mm;
};
// Camera mm to px; nowhere where there is no label, and before the nearest that is shown.
void project_points(const FlowLens& lens, const std::int32_t* label, const float* x, const float* y,
                    const float* z, unsigned count, float* px, float* py);

// x and y in turn; 0 where the point lands nowhere.
void subtract_places(const float* x, const float* y, const float* own_x, const float* own_y,
                     unsigned count, float* to);

// Places and labels of a row, or of the one above or below it.
struct FlowPlaces {
  const float *x, *y;
  const std::int32_t* label;
};

// A picture's depth, and what it tells of points that lie near what it shows.
struct ShownDepth {
  const float* depth_mm;
  int width, height;
  float pixel;  // that a pixel measures at 1 mm

  bool holds(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  // Whether a point that lies at px lies on or before what a pixel of the picture shows.
  bool before(float px, float py, float depth_mm, int x, int y) const;
};

// Whether the picture shows points that land in it: yes, no, or what has still to be asked.
inline constexpr std::int32_t kFlowHidden = 0, kFlowSeen = 1, kFlowMayTurnAway = 2,
                              kFlowBesideOutline = 4;
// Of up to kFlowSpan points. A neighbour to the left of the first and one to the right of the last
// point are looked at.
void find_seen(const ShownDepth& picture, const FlowPlaces& above, const FlowPlaces& row,
               const FlowPlaces& below, const float* depth_mm, unsigned count,
               std::int32_t* answers);

}  // namespace organbake
