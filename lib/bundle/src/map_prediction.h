// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/bundle/bundle.h"

namespace organbake {

// What is known of a texel of a map, coded row after row, from those before it.

// How a texel's face is known: none; as that of a neighbour that was before; or it is listed.
enum class FaceFrom : std::uint8_t { none, left, above, above_left, above_right, list };

// The texels that come before one, as far as they are in use: offsets, 0 for none.
struct Before {
  std::size_t left = 0, above = 0, above_left = 0, above_right = 0, left2 = 0, above2 = 0;
};

template <class Used>
Before before(std::size_t i, int x, int y, int width, const Used& used) {
  const auto offset = [&](bool inside, std::size_t by) { return inside && used(i - by) ? by : 0; };
  const auto row = static_cast<std::size_t>(width);
  return {offset(x > 0, 1),
          offset(y > 0, row),
          offset(x > 0 && y > 0, row + 1),
          offset(x + 1 < width && y > 0, row - 1),
          offset(x > 1, 2),
          offset(y > 1, 2 * row)};
}

inline std::size_t neighbour(FaceFrom from, const Before& b) {
  switch (from) {
    case FaceFrom::left:
      return b.left;
    case FaceFrom::above:
      return b.above;
    case FaceFrom::above_left:
      return b.above_left;
    case FaceFrom::above_right:
      return b.above_right;
    default:
      return 0;
  }
}

// A surface goes on as it came: the plane through three texels, else a line through two.
template <class Number>
Number foretold(const Number* at, const Before& b, Number last) {
  if (b.left && b.above && b.above_left)
    return static_cast<Number>(at[-std::ptrdiff_t(b.left)] + at[-std::ptrdiff_t(b.above)] -
                               at[-std::ptrdiff_t(b.above_left)]);
  if (b.above && b.above2)
    return static_cast<Number>(2 * at[-std::ptrdiff_t(b.above)] - at[-std::ptrdiff_t(b.above2)]);
  if (b.left && b.left2)
    return static_cast<Number>(2 * at[-std::ptrdiff_t(b.left)] - at[-std::ptrdiff_t(b.left2)]);
  if (b.above) return at[-std::ptrdiff_t(b.above)];
  if (b.left) return at[-std::ptrdiff_t(b.left)];
  return last;
}

// A colour lies between its neighbours', and where there is an edge on one side of it (the median
// edge detector of JPEG-LS).
inline std::uint8_t foretold_color(const std::uint8_t* at, const Before& b, std::uint8_t last) {
  if (b.left && b.above) {
    const int l = at[-std::ptrdiff_t(b.left)], a = at[-std::ptrdiff_t(b.above)];
    if (!b.above_left) return static_cast<std::uint8_t>((l + a) / 2);
    const int corner = at[-std::ptrdiff_t(b.above_left)];
    const int low = std::min(l, a), high = std::max(l, a);
    return static_cast<std::uint8_t>(corner >= high ? low : corner <= low ? high : l + a - corner);
  }
  if (b.above) return at[-std::ptrdiff_t(b.above)];
  if (b.left) return at[-std::ptrdiff_t(b.left)];
  return last;
}

inline FaceFrom face_from(const std::uint32_t* face, const Before& b) {
  for (const FaceFrom from :
       {FaceFrom::left, FaceFrom::above, FaceFrom::above_left, FaceFrom::above_right}) {
    const std::size_t by = neighbour(from, b);
    if (by && face[-std::ptrdiff_t(by)] == *face) return from;
  }
  return FaceFrom::list;
}

// visit(i, Before) for each texel in use, in order.
template <class Visit>
void for_each_used(const std::vector<std::uint32_t>& face, int width, const Visit& visit) {
  const auto used = [&](std::size_t i) { return face[i] != kNoFace; };
  const int height = static_cast<int>(face.size() / static_cast<std::size_t>(width));
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      if (used(i)) visit(i, before(i, x, y, width, used));
    }
  }
}

}  // namespace organbake
