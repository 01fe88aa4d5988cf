// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "picture/spans.h"

namespace organbake {

// Eigen adds three floats up in another order where registers hold two of them: here it is fixed,
// so that every processor finds the same bits.
[[gnu::always_inline]] inline float ordered_dot(const Eigen::Vector3f& a,
                                                const Eigen::Vector3f& b) {
  return a.x() * b.x() + (a.y() * b.y() + a.z() * b.z());
}
[[gnu::always_inline]] inline Eigen::Vector3f unit_vector(const Eigen::Vector3f& v) {
  const float squared = ordered_dot(v, v);
  return squared > 0 ? Eigen::Vector3f(v / std::sqrt(squared)) : v;
}

// So many pixels are lit together: a span's, of all its rows. Pixel i of row r is r · kSpan + i.
inline constexpr int kMostSkin = kSpanRows * kSpan;

// Some pixels of a span's rows whose light is worked out, and the place on the proxy whose skin
// each shows.
struct SkinPixels {
  int count = 0;
  alignas(32) std::int32_t at[kMostSkin];  // pixel of the rows
  alignas(32) std::uint32_t face[kMostSkin];
  alignas(32) float b1[kMostSkin], b2[kMostSkin];

  void add(int pixel, std::uint32_t on_face, float at_b1, float at_b2) {
    at[count] = pixel;
    face[count] = on_face;
    b1[count] = at_b1, b2[count] = at_b2;
    ++count;
  }
  // To whole vectors, which are looked up: with a place that there is.
  void fill_up() {
    for (unsigned i = count; i < whole_vectors(count); ++i)
      at[i] = 0, face[i] = 0, b1[i] = b2[i] = 0;
  }
};

// The colours of a row of a span: `count` pixels of the picture's row y from column x0 on. Gloss is
// added in parts of `white`. All planes have room for whole vectors (spans.h).
struct SpanColors {
  int x0 = 0, y = 0, count = 0;
  std::array<float*, 3> planes;
  const float* white = nullptr;
  const float* depth_mm = nullptr;  // planar z of what is seen, +inf where there is none
};

// Four numbers of each pixel, the fourth often unused, one plane for each.
struct SkinPlanes {
  alignas(64) float of[4][kMostSkin];

  std::array<float*, 3> planes() { return {of[0], of[1], of[2]}; }
};

// A view with the light at the scope, as plain numbers, so that loops over pixels see constants.
struct ScopeView {
  std::array<float, 3> right, down, origin;  // a pixel's ray, of depth 1
  std::array<float, 3> light, forward;       // from the eye, mm; the view's axis
  float full = 1;                            // gain · reference², mm²
  float inverse_tan2_half = 1;
  float inverse_pixel = 1;  // pixels to a mm at depth 1 mm
};

// Skin at some places of a picture, as the light at the scope takes it: x, y, z.
struct ScopeSkin {
  int count = 0;
  alignas(64) float column[kMostSkin], row[kMostSkin];  // their centre's
  alignas(64) float depth_mm[kMostSkin];                // planar z
  SkinPlanes normals;                                   // now, world, any length
  // Where it lies at rest; the normals' fourth: how they bend, rad a mm, the most of any way; of a
  // whole film, as it lies now.
  SkinPlanes rest_normals, rest_mm;

  void place(int k, int pixel, std::span<const SpanColors> rows) {
    const SpanColors& own = rows[pixel / kSpan];
    column[k] = static_cast<float>(own.x0 + pixel % kSpan) + 0.5f;
    row[k] = static_cast<float>(own.y) + 0.5f;
    depth_mm[k] = own.depth_mm[pixel % kSpan];
  }
};

// What the light at the scope makes of skin that is `white` where all of it counts: colours times
// `times`, and `rim` and ScopeShine::kSheen `sheen` of the white.
struct ScopeLit {
  SkinPlanes times;
  alignas(64) float rim[kMostSkin], sheen[kMostSkin];
  alignas(64) std::int32_t film_near[kMostSkin];  // 1 where a film may show there or beside it
};

// A lobe of mirrored light: how bright in its middle, and how wide.
struct ShineLobe {
  float strength = 0, alpha2 = 1;
};

inline float positive(float v) { return v > 0 ? v : 0; }
inline float at_most_1(float v) { return v < 1 ? v : 1; }
// Of what is so many pixels long, how much a pixel can show: all from four on.
inline float resolved(float pixels) { return at_most_1(positive(0.5f * pixels - 1)); }

// How light and eye stand to a pixel's skin.
struct ScopeRay {
  float light[3], eye[3], half_way[3];  // towards them, unit
  float share;                          // of full exposure

  static constexpr float kNearest_mm2 = 1;  // of a light that touches the skin
};
[[gnu::always_inline]] inline ScopeRay scope_ray(const ScopeView& view, float column, float row,
                                                 float depth_mm) {
  ScopeRay at;
  float ray[3], range2 = 0, length2 = 0, ahead = 0, half2 = 1e-20f;
  for (int c = 0; c < 3; ++c) {
    ray[c] = view.origin[c] + row * view.down[c] + column * view.right[c];
    at.light[c] = view.light[c] - depth_mm * ray[c];
    range2 += at.light[c] * at.light[c];
    length2 += ray[c] * ray[c];
  }
  const float inverse_range =
      1 / std::sqrt(range2 > ScopeRay::kNearest_mm2 ? range2 : ScopeRay::kNearest_mm2);
  const float to_eye = -1 / std::sqrt(length2);
  for (int c = 0; c < 3; ++c) {
    at.light[c] *= inverse_range;
    at.eye[c] = to_eye * ray[c];
    at.half_way[c] = at.light[c] + at.eye[c];
    half2 += at.half_way[c] * at.half_way[c];
    ahead -= at.light[c] * view.forward[c];
  }
  const float to_half = 1 / std::sqrt(half2), before = ahead > 0 ? ahead : 0;
  for (float& part : at.half_way) part *= to_half;
  const float ahead2 = before * before;
  at.share = view.full * inverse_range * inverse_range * ahead2 /
             (ahead2 + (1 - ahead2) * view.inverse_tan2_half + 1e-12f);
  return at;
}

// What light depends on changes slowly over skin that runs on: of four rows of sixteen pixels it is
// worked out for eight, four of the first and four of the last, and mixed between them; for four of
// a row that runs on alone; for every pixel where the skin breaks off or falls away steeply, and
// where light of the scope turns out to bend between knots. Groups lie at multiples of sixteen of
// the picture's columns, and of four of its rows, so that a pixel's light does not depend on which
// part of the picture is drawn.
class SparseShading {
 public:
  static constexpr int kGroup = 16, kPixels = kSpanRows * kGroup;
  using Rows = float[kSpanRows][kSpan];

  // depth_mm: of the span's skin, +inf where none is to be lit; its first column is a multiple
  // of kGroup, its first row one of kSpanRows; kept by reference. texel_mm: of the cameras, on the
  // surface.
  SparseShading(const Rows& depth_mm, int rows, int count, float texel_mm);

  // By the light of the knots, asks for every pixel of the rows over which it bends. Whether there
  // are any: then the knots are others, whose rows bend no more.
  bool refine(const float* light);

  // The pixels that are asked for, by group.
  int knot_count() const { return first_knot_[groups()][0]; }
  int knot(int k) const { return knots_[k]; }

  int rows() const { return rows_; }
  int groups() const { return static_cast<int>(whole_vectors(count_)) / kGroup; }
  int first_knot(int g) const { return first_knot_[g][0]; }

  // The numbers of group g, kSpanRows rows of kGroup, from those of the span's knots: as they are,
  // linear between them, 0 where nothing is to be lit. Equal numbers stay what they are.
  void mix(int g, const float* of_knots, float* __restrict group) const;
  // Three of each pixel, from a place on.
  void mix(int g, const SkinPlanes& of_knots, SkinPlanes& group, int first = 0) const {
    for (int c = 0; c < 3; ++c) mix(g, of_knots.of[c], group.of[c] + first);
  }

 private:
  enum class Kind : std::uint8_t { by_pixel, row, block };
  void place_knots();

  const Rows& depth_mm_;
  int rows_, count_;
  std::array<std::array<Kind, kSpanRows>, kSpan / kGroup> kinds_;
  std::array<std::int32_t, kMostSkin> knots_;
  std::array<std::array<std::int32_t, kSpanRows>, kSpan / kGroup + 1> first_knot_;
};

}  // namespace organbake
