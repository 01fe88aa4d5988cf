// SPDX-License-Identifier: Apache-2.0
// RelitSkin by the pixel; what it does by the node, in Eigen's words, is in relit_skin.cpp.
#include <algorithm>
#include <array>
#include <limits>

#include "light/relit_skin.h"
#include "picture/vector_loops.h"

namespace organbake {

using Eigen::Vector3f;
using Eigen::Vector4f;

// Each pixel's lattice triangle: the one that holds its place, or the nearest for a place outside
// the face, as a sample's on its edge may show it. By its nodes, and the weights of the second and
// the third at the nearest place within, and where the pixel's own lies. Light ends at the edge:
// normals that went on would lean on beyond it, where the next face's do not. Places at rest go on.
struct LatticeTriangles {
  alignas(64) std::int32_t corner[kSpan], below[kSpan], beside[kSpan];
  alignas(64) float along[kSpan], down[kSpan], own_along[kSpan], own_down[kSpan];

  LatticeTriangles(const SkinPixels& skin, const BaseLayer& lattice);
};

namespace {

ORGANBAKE_MULTIVERSION void find_triangles(const SkinPixels& skin, std::int32_t steps,
                                           std::int32_t nodes_per_face,
                                           LatticeTriangles& __restrict out) {
  const auto n = static_cast<float>(steps);
  const auto index = [&](std::int32_t i, std::int32_t j) {
    return static_cast<std::int32_t>(
        base_node_index(std::uint32_t(steps), std::uint32_t(i), std::uint32_t(j)));
  };
  const auto near = [](float v) { return v > -1 ? (v < 2 ? v : 2) : -1; };
  const auto within = [](float v) { return v > 0 ? (v < 1 ? v : 1) : 0; };
  const auto cell = [](float at, std::int32_t last) {
    const auto whole = static_cast<std::int32_t>(at > 0 ? at : 0);
    return whole < last ? whole : last;
  };
  for (unsigned k = 0; k < whole_vectors(skin.count); ++k) {
    const float u = skin.b1[k] * n, v = skin.b2[k] * n;
    const std::int32_t i = cell(u, steps - 1), j = cell(v, steps - 1 - i);
    const float along = near(u - static_cast<float>(i)), down = near(v - static_cast<float>(j));
    // The quad's other triangle, from its far corner; on the face's long edge there is none.
    const bool other = (along + down > 1) & (i + j + 2 <= steps);
    const float a = within(along), d = within(down), beyond = a + d - 1;
    const float over = (!other & (beyond > 0)) ? 0.5f * beyond : 0;
    out.along[k] = other ? 1 - d : a - over;
    out.down[k] = other ? 1 - a : d - over;
    out.own_along[k] = other ? 1 - down : along;
    out.own_down[k] = other ? 1 - along : down;
    const std::int32_t first = static_cast<std::int32_t>(skin.face[k]) * nodes_per_face;
    out.corner[k] = first + (other ? index(i + 1, j + 1) : index(i, j));
    out.below[k] = first + index(i + 1, j);
    out.beside[k] = first + index(i, j + 1);
  }
}

}  // namespace

LatticeTriangles::LatticeTriangles(const SkinPixels& skin, const BaseLayer& lattice) {
  find_triangles(skin, static_cast<std::int32_t>(lattice.steps),
                 static_cast<std::int32_t>(lattice.nodes_per_face()), *this);
}

template <Eigen::Vector4f RelitSkin::Node::*number>
void RelitSkin::mix(const LatticeTriangles& t, int count, ShadedPosts& mixed) const {
  constexpr bool own = number == &Node::rest_mm;
  const float *const along = own ? t.own_along : t.along, *const down = own ? t.own_down : t.down;
  // Plain numbers: Eigen's expressions are fused differently on another processor.
  for (int k = 0; k < count; ++k) {
    const float a = along[k], d = down[k], rest = 1 - a - d;
    const Vector4f &corner = nodes_[t.corner[k]].*number, &below = nodes_[t.below[k]].*number,
                   &beside = nodes_[t.beside[k]].*number;
    std::array<float, 4> sum;  // in a register, where a row of `mixed` could be one of a node
    for (int c = 0; c < 4; ++c) sum[c] = rest * corner[c] + a * below[c] + d * beside[c];
    std::copy(sum.begin(), sum.end(), mixed.rows[k]);
  }
  Eigen::Map<Vector4f, Eigen::Aligned16>(mixed.rows[count]) = Node().*number;
}

void RelitSkin::light(const SkinPixels& skin, const SparseShading& span, const SpanColors& colors,
                      ScopeSpan& from_scope) const {
  if (skin.count == 0) return;
  const LatticeTriangles triangles(skin, lattice_);
  const ShadingInterpolation spread(span, skin.at, skin.count);
  ShadedPosts mixed;
  mix<&Node::gain>(triangles, skin.count, mixed);
  SkinPlanes<3> gains;
  spread(mixed, gains.planes());
  for (int c = 0; c < 3; ++c) {
    float* const plane = colors.planes[c];
    for (int i = 0; i < colors.count; ++i) plane[i] *= gains.of[c][i];
  }
  mix<&Node::normal>(triangles, skin.count, mixed);
  if (from_scope_) {
    spread(mixed, from_scope.skin.normals.planes());
    return light_scope(skin, triangles, spread, colors, from_scope);
  }
  const auto shines = [&](std::uint32_t face) { return shines_[face] != 0; };
  if (std::none_of(skin.face, skin.face + skin.count, shines)) return;
  SkinDirections normals;
  spread(mixed, normals.planes());
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
void RelitSkin::light_scope(const SkinPixels& skin, const LatticeTriangles& triangles,
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
    mix<&Node::rest_mm>(triangles, skin.count, mixed);
    spread(mixed, from_scope.at_rest.places_mm.planes());
    shine_.add_grain(from_scope.skin, from_scope.at_rest, nearest, colors);
  }
  from_scope.film_shows = shine_.light(from_scope.skin, colors, from_scope.lit);
}

namespace {

// Rows of some pixels into planes from pixel `first` on.
void put(const ShadedPosts& rows, unsigned first, int count, SkinDirections& planes) {
  for (unsigned k = 0; k < whole_vectors(count); ++k) {
    for (int c = 0; c < 3; ++c) planes.of[c][first + k] = rows.rows[k][c];
  }
}

}  // namespace

// By the pixel: drops are narrower than the distance of knots, and knots move over the skin.
void RelitSkin::add_film(const SkinPixels& skin, unsigned first, const SpanColors& colors,
                         ScopeSpan& from_scope) const {
  const LatticeTriangles triangles(skin, lattice_);
  ShadedPosts mixed;
  mix<&Node::normal>(triangles, skin.count, mixed);
  put(mixed, first, skin.count, from_scope.skin.normals);
  mix<&Node::rest_normal>(triangles, skin.count, mixed);
  put(mixed, first, skin.count, from_scope.at_rest.normals);
  mix<&Node::rest_mm>(triangles, skin.count, mixed);
  put(mixed, first, skin.count, from_scope.at_rest.places_mm);
  shine_.add_film(from_scope, first, skin.count, colors);
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
