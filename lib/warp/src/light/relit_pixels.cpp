// SPDX-License-Identifier: Apache-2.0
// RelitSkin by the pixel; what it does by the node, in Eigen's words, is in relit_skin.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "light/relit_skin.h"
#include "picture/vector_loops.h"

namespace organbake {

using Eigen::Vector3f;

// Each pixel's lattice triangle: the one that holds its place, or the nearest for a place outside
// the face, as a sample's on its edge may show it. By its nodes, and the weights of the second and
// the third at the nearest place within. Light ends there: normals that went on would lean on
// beyond the edge, where the next face's do not. Places at rest go on, by the weights' rest.
struct RelitSkin::Triangles {
  alignas(32) std::int32_t corner[kSpan], below[kSpan], beside[kSpan];
  alignas(32) float along[kSpan], down[kSpan], more_along[kSpan], more_down[kSpan];
};

void RelitSkin::find_triangles(const SkinPixels& skin, Triangles& out) const {
  const auto steps = static_cast<std::int32_t>(lattice_.steps);
  const auto nodes_per_face = static_cast<std::int32_t>(lattice_.nodes_per_face());
  const auto n = static_cast<float>(steps);
  const auto index = [&](std::int32_t i, std::int32_t j) {
    return static_cast<std::int32_t>(
        base_node_index(lattice_.steps, std::uint32_t(i), std::uint32_t(j)));
  };
  const int count = skin.count;
  ORGANBAKE_INDEPENDENT
  for (int k = 0; k < count; ++k) {
    const float u = skin.b1[k] * n, v = skin.b2[k] * n;
    const auto cell = [](float at, std::int32_t last) {
      const auto whole = static_cast<std::int32_t>(at > 0 ? at : 0);
      return whole < last ? whole : last;
    };
    const std::int32_t i = cell(u, steps - 1), j = cell(v, steps - 1 - i);
    const auto near = [](float v) { return v > -1 ? (v < 2 ? v : 2) : -1; };
    const float along = near(u - static_cast<float>(i)), down = near(v - static_cast<float>(j));
    // The quad's other triangle, from its far corner; on the face's long edge there is none.
    const bool other = (along + down > 1) & (i + j + 2 <= steps);
    const auto within = [](float v) { return v > 0 ? (v < 1 ? v : 1) : 0; };
    const float a = within(along), d = within(down), beyond = a + d - 1;
    const float over = !other & (beyond > 0) ? 0.5f * beyond : 0;
    out.along[k] = other ? 1 - down : a - over;
    out.down[k] = other ? 1 - along : d - over;
    out.more_along[k] = other ? 0 : along - (a - over);
    out.more_down[k] = other ? 0 : down - (d - over);
    const std::int32_t first = static_cast<std::int32_t>(skin.face[k]) * nodes_per_face;
    out.corner[k] = first + (other ? index(i + 1, j + 1) : index(i, j));
    out.below[k] = first + index(i + 1, j);
    out.beside[k] = first + index(i, j + 1);
  }
}

template <class AnyNode>
void RelitSkin::mix_nodes(const std::vector<AnyNode>& nodes, const AnyNode& elsewhere,
                          const Triangles& t, int count, ShadedPosts& mixed) {
  for (int k = 0; k < count; ++k) {
    const float along = t.along[k], down = t.down[k], rest = 1 - along - down;
    const float* __restrict const corner = nodes[t.corner[k]].mixed.data();
    const float* __restrict const below = nodes[t.below[k]].mixed.data();
    const float* __restrict const beside = nodes[t.beside[k]].mixed.data();
    float* __restrict const out = mixed.rows[k];
    for (int c = 0; c < 8; ++c) out[c] = rest * corner[c] + along * below[c] + down * beside[c];
  }
  std::copy(elsewhere.mixed.begin(), elsewhere.mixed.end(), mixed.rows[count]);
}

void RelitSkin::mix_rest(const Triangles& t, int count, ShadedPosts& mixed) const {
  mix_nodes(rest_nodes_, RestNode(), t, count, mixed);
  for (int k = 0; k < count; ++k) {
    const float along = t.more_along[k], down = t.more_down[k];
    const float* const corner = rest_nodes_[t.corner[k]].mixed.data();
    const float* const below = rest_nodes_[t.below[k]].mixed.data();
    const float* const beside = rest_nodes_[t.beside[k]].mixed.data();
    for (int c = 3; c < 6; ++c)
      mixed.rows[k][c] += along * (below[c] - corner[c]) + down * (beside[c] - corner[c]);
  }
}

void RelitSkin::light(const SkinPixels& skin, const SparseShading& span, const SpanColors& colors,
                      ScopeSpan& from_scope) const {
  if (skin.count == 0) return;
  Triangles triangles;
  find_triangles(skin, triangles);
  ShadedPosts mixed;
  mix_nodes(nodes_, Node(), triangles, skin.count, mixed);
  const ShadingInterpolation spread(span, skin.at, skin.count);
  SkinPlanes<3> gains;
  spread(mixed, 0, gains.planes());
  for (int c = 0; c < 3; ++c) {
    float* const plane = colors.planes[c];
    for (int i = 0; i < colors.count; ++i) plane[i] *= gains.of[c][i];
  }
  if (from_scope_) {
    spread(mixed, 3, from_scope.skin.normals.planes());
    return light_scope(skin, triangles, spread, colors, from_scope);
  }
  const auto shines = [&](std::uint32_t face) { return shines_[face] != 0; };
  if (std::none_of(skin.face, skin.face + skin.count, shines)) return;
  SkinDirections normals;
  spread(mixed, 3, normals.planes());
  add_gloss(normals, colors);
}

namespace {

// In as many chains as a vector has lanes: one would wait for each comparison in turn.
float nearest_of(const float* depth_mm, int count) {
  std::array<float, kLanes> least;
  least.fill(std::numeric_limits<float>::infinity());
  const int lanes = static_cast<int>(kLanes), whole = count / lanes * lanes;
  for (int first = 0; first < whole; first += lanes) {
    for (unsigned lane = 0; lane < kLanes; ++lane) {
      const float depth = depth_mm[static_cast<unsigned>(first) + lane];
      least[lane] = depth < least[lane] ? depth : least[lane];
    }
  }
  float nearest = *std::min_element(least.begin(), least.end());
  for (int i = whole; i < count; ++i) nearest = std::min(nearest, depth_mm[i]);
  return nearest;
}

}  // namespace

// Where skin lies at rest is asked for only where gloss or grain may show: both are bound to it.
void RelitSkin::light_scope(const SkinPixels& skin, const Triangles& triangles,
                            const ShadingInterpolation& spread, const SpanColors& colors,
                            ScopeSpan& from_scope) const {
  float* const depth_mm = from_scope.skin.depth_mm;
  std::fill_n(depth_mm, kSpan, 1.0f);
  for (int i = 0; i < colors.count; ++i) {
    const float depth = colors.depth_mm[i];
    depth_mm[i] = depth < std::numeric_limits<float>::infinity() ? depth : 1;
  }
  const float nearest = nearest_of(colors.depth_mm, colors.count);
  if (shine_.grain_shows(nearest)) {
    ShadedPosts mixed;
    mix_rest(triangles, skin.count, mixed);
    spread(mixed, 3, from_scope.at_rest.places_mm.planes());
    shine_.add_grain(from_scope.skin, from_scope.at_rest, nearest, colors);
  }
  from_scope.film_shows = shine_.light(from_scope.skin, colors, from_scope.lit);
}

// By the pixel: drops are narrower than the distance of knots, and knots move over the skin.
void RelitSkin::add_film(const SkinPixels& skin, const SpanColors& colors,
                         ScopeSpan& from_scope) const {
  Triangles triangles;
  find_triangles(skin, triangles);
  ShadedPosts now, at_rest;
  mix_nodes(nodes_, Node(), triangles, skin.count, now);
  mix_rest(triangles, skin.count, at_rest);
  SkinDirections& normal = from_scope.lit.normal;
  from_scope.at_rest = {};
  for (int k = 0; k < skin.count; ++k) {
    const int i = skin.at[k];
    const Eigen::Map<const Vector3f> given(now.rows[k] + 3);
    // On the side that is seen, as light() has turned the mixed one.
    const float turned =
        given[0] * normal.of[0][i] + given[1] * normal.of[1][i] + given[2] * normal.of[2][i];
    const float scale = (turned < 0 ? -1.f : 1.f) / std::sqrt(given.squaredNorm() + 1e-20f);
    for (int c = 0; c < 3; ++c) {
      normal.of[c][i] = scale * given[c];
      from_scope.at_rest.normals.of[c][i] = at_rest.rows[k][c];
      from_scope.at_rest.places_mm.of[c][i] = at_rest.rows[k][3 + c];
    }
  }
  shine_.add_gloss(from_scope.lit, from_scope.skin, from_scope.at_rest, colors);
}

// By the pixel: a highlight may be narrower than the distance of knots.
void RelitSkin::add_gloss(const SkinDirections& normals, const SpanColors& colors) const {
  SkinDirections toward_eye;
  const Vector3f row = ray_origin_ + (static_cast<float>(colors.y) + 0.5f) * ray_down_;
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < colors.count; ++i)
      toward_eye.of[c][i] = -(row[c] + (static_cast<float>(colors.x0 + i) + 0.5f) * ray_right_[c]);
  }
  SkinPlanes<3> gloss;
  gloss_.shine(normals, toward_eye, colors.count, gloss);
  for (int c = 0; c < 3; ++c) {
    float* const plane = colors.planes[c];
    for (int i = 0; i < colors.count; ++i) plane[i] += colors.white[i] * gloss.of[c][i];
  }
}

}  // namespace organbake
