// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>

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

// Pixels of a span whose light is worked out, and the place on the proxy whose skin each shows.
struct SkinPixels {
  int count = 0;
  alignas(32) std::int32_t at[kSpan];  // of the span
  alignas(32) std::uint32_t face[kSpan];
  alignas(32) float b1[kSpan], b2[kSpan];

  void add(int pixel, std::uint32_t on_face, float at_b1, float at_b2) {
    at[count] = pixel;
    face[count] = on_face;
    b1[count] = at_b1, b2[count] = at_b2;
    ++count;
  }
  // To whole vectors, which are looked up: with a place that there is.
  void fill_up() {
    for (unsigned i = count; i < whole_vectors(count); ++i) face[i] = 0, b1[i] = b2[i] = 0;
  }
};

// The colours of a span: `count` pixels of the picture's row y from column x0 on. Gloss is added
// in parts of `white`. All planes have room for whole vectors (spans.h).
struct SpanColors {
  int x0 = 0, y = 0, count = 0;
  std::array<float*, 3> planes;
  const float* white = nullptr;
  const float* depth_mm = nullptr;  // planar z of what is seen, +inf where there is none
};

// One plane for each of a pixel's numbers.
template <int numbers>
struct SkinPlanes {
  alignas(64) float of[numbers][kSpan];

  std::array<float*, numbers> planes() {
    std::array<float*, numbers> all;
    for (int c = 0; c < numbers; ++c) all[c] = of[c];
    return all;
  }
};
using SkinDirections = SkinPlanes<3>;  // x, y, z

// The same, as the loops take them.
struct SkinVectors {
  const float *x, *y, *z;

  explicit SkinVectors(const SkinDirections& planes)
      : x(planes.of[0]), y(planes.of[1]), z(planes.of[2]) {}
  SkinVectors(const float* of_x, const float* of_y, const float* of_z)
      : x(of_x), y(of_y), z(of_z) {}
  // Its axes in another order.
  SkinVectors turned() const { return {y, z, x}; }
};

// What a span of skin is to the light at the scope, by pixel.
struct ScopeSkin {
  alignas(64) float depth_mm[kSpan];  // planar z; any where there is no skin
  SkinDirections normals;             // now, world, any length; 0 where there is no skin
};
// Where that skin lies at rest.
struct ScopeSkinAtRest {
  SkinDirections normals, places_mm;
  // Of the lattice's normals, rad a mm, the most of any way; of a whole film, as it lies now.
  alignas(64) float bends[kSpan];
};

// What is worked out for all pixels, and asked for again where gloss may show.
struct ScopeLit {
  alignas(64) float share[kSpan];  // of full exposure
  alignas(64) float shows[kSpan];  // 0…1, of gloss
  SkinDirections half_way;         // unit
};

// A span lit from the scope but for its film, which is narrower than the distance of knots.
struct ScopeSpan {
  bool film_shows = false;  // anywhere; nothing of the rest is told otherwise
  ScopeSkin skin;
  ScopeSkinAtRest at_rest;
  ScopeLit lit;
};

// A lobe of mirrored light: how bright in its middle, and how wide.
struct ShineLobe {
  float strength = 0, alpha2 = 1;
};

inline float positive(float v) { return v > 0 ? v : 0; }
inline float at_most_1(float v) { return v < 1 ? v : 1; }
// Of what is so many pixels long, how much a pixel can show: all from four on.
inline float resolved(float pixels) { return at_most_1(positive(0.5f * pixels - 1)); }

// Of ScopeLit::shows, whole vectors. Without an early end, which would ask one by one.
inline bool any_shows(const float* shows, unsigned count) {
  int any = 0;
  for (unsigned i = 0; i < count; ++i) any |= shows[i] > 0;
  return any != 0;
}

// visit(first, count) for the whole vectors of ScopeLit::shows in which gloss does, those side by
// side together.
template <class Visit>
void each_shown_part(const float* shows, int count, const Visit& visit) {
  const unsigned last = whole_vectors(count);
  for (unsigned first = 0, end; first < last; first = end + kLanes) {
    for (end = first; end < last && any_shows(shows + end, kLanes);) end += kLanes;
    if (end > first) visit(first, static_cast<int>(end - first));
  }
}

// What light depends on changes slowly over skin that runs on: of each sixteen pixels of a row it
// is worked out for four, and mixed between them; for every pixel where the skin breaks off or
// falls away steeply. Groups lie at multiples of sixteen of the picture's columns, so that a
// pixel's light does not depend on which part of the picture is drawn.
class SparseShading {
 public:
  static constexpr int kGroup = 16;

  // depth_mm: of the span's skin, +inf where none is to be lit; its first column is a multiple
  // of kGroup. texel_mm: of the cameras, on the surface.
  SparseShading(const float* depth_mm, int count, float texel_mm);

  // The pixels that are asked for, by their place in the span, ascending.
  int knot_count() const { return post_count_; }
  int knot(int k) const { return knots_[k]; }

  // Whether group g runs on: it has four knots, its first and last pixel among them.
  bool smooth(int g) const { return smooth_[g]; }
  int count() const { return count_; }  // pixels

 private:
  int count_;
  std::array<bool, kSpan / kGroup> smooth_{};
  int post_count_ = 0;
  std::array<std::int32_t, kSpan> knots_;
};

// What is known of some of a span's knots, three numbers each and an unused one; row `count` holds
// what stands where nothing is known.
struct ShadedPosts {
  alignas(64) float rows[kSpan + 1][4];
};

// Spreads such tables over all pixels of their span.
class ShadingInterpolation {
 public:
  // at[k]: the pixel that row k is known of, one of the span's knots.
  ShadingInterpolation(const SparseShading& span, const std::int32_t* at, int count);

  // Into planes, whole vectors of the span. Equal numbers stay what they are.
  void operator()(const ShadedPosts& table, const std::array<float*, 3>& planes) const;

 private:
  const SparseShading& span_;
  std::array<std::int16_t, kSpan> row_;
};

}  // namespace organbake
