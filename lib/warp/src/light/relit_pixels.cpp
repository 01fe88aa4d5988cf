// SPDX-License-Identifier: Apache-2.0
// RelitSkin by the pixel: light is found at a span's knots and spread between them, gloss for every
// pixel. What it does by the node, in Eigen's words, is in relit_skin.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "light/relit_skin.h"
#include "light/skin_light.h"
#include "picture/spans.h"

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
};

namespace {

constexpr int kGroup = SparseShading::kGroup;
constexpr std::array kKnots = {0, 5, 10, kGroup - 1};  // of a group that runs on

// Neighbours whose depths differ by more texels than this lie beside a break, or on skin that is
// seen at a grazing angle.
constexpr float kSmoothTexels = 4;

// How far each pixel of a group lies from knot k to the next.
constexpr std::array<float, kGroup> way_on(std::size_t k) {
  std::array<float, kGroup> ways{};
  for (int i = 0; i < kGroup; ++i)
    ways[i] = std::clamp(float(i - kKnots[k]) / float(kKnots[k + 1] - kKnots[k]), 0.0f, 1.0f);
  return ways;
}

// A group's numbers from those of its knots, linear between them.
inline void mix_group(const std::array<float, 4>& at, float* __restrict group) {
  static constexpr std::array kWays = {way_on(0), way_on(1), way_on(2)};
  // Unrolled before it becomes a vector, its weights would be worked with one by one.
#pragma GCC unroll 1
  for (int i = 0; i < kGroup; ++i)
    group[i] = at[0] + kWays[0][i] * (at[1] - at[0]) + kWays[1][i] * (at[2] - at[1]) +
               kWays[2][i] * (at[3] - at[2]);
}

// Whether all pixels of a group run on to the next, the last wherever it goes.
inline bool all_run_on(const std::uint8_t* runs_on) {
  constexpr std::uint8_t kAll[] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
  static_assert(sizeof kAll == kGroup - 1);
  return std::memcmp(runs_on, kAll, sizeof kAll) == 0;
}

// Less of a lamp of 1 is not seen: half a level where a picture is darkest.
constexpr double kLeastGloss = 2e-4;

ORGANBAKE_MULTIVERSION void find_triangles(const SkinPixels& skin, const BaseLayer& lattice,
                                           LatticeTriangles& __restrict out) {
  const auto steps = static_cast<std::int32_t>(lattice.steps);
  const auto nodes_per_face = static_cast<std::int32_t>(lattice.nodes_per_face());
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

SparseShading::SparseShading(const float* depth_mm, int count, float texel_mm) : count_(count) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float smooth_mm = kSmoothTexels * texel_mm;
  alignas(64) std::array<std::uint8_t, kSpan>
      runs_on;  // to the next pixel; not where either is +inf
  for (int i = 0; i + 1 < count; ++i)
    runs_on[i] = std::abs(depth_mm[i + 1] - depth_mm[i]) <= smooth_mm;
  for (int first = 0; first < count; first += kGroup) {
    smooth_[first / kGroup] = first + kGroup <= count && all_run_on(&runs_on[first]);
    if (smooth_[first / kGroup]) {
      for (const int at : kKnots) knots_[post_count_++] = first + at;
      continue;
    }
    for (int i = first; i < std::min(first + kGroup, count); ++i) {
      knots_[post_count_] = i;
      post_count_ += depth_mm[i] < kInfinity;
    }
  }
}

ShadingInterpolation::ShadingInterpolation(const SparseShading& span, const std::int32_t* at,
                                           int count)
    : span_(span) {
  row_.fill(static_cast<std::int16_t>(count));
  for (int k = 0; k < count; ++k) row_[at[k]] = static_cast<std::int16_t>(k);
}

void ShadingInterpolation::operator()(const ShadedPosts& table,
                                      const std::array<float*, 3>& planes) const {
  const int groups = static_cast<int>(whole_vectors(span_.count())) / kGroup;
  for (int g = 0; g < groups; ++g) {
    const std::int16_t* const row = &row_[std::size_t(g) * kGroup];
    if (span_.smooth(g)) {
      std::array<const float*, kKnots.size()> at;
      for (std::size_t k = 0; k < at.size(); ++k) at[k] = table.rows[row[kKnots[k]]];
      for (int c = 0; c < 3; ++c)
        mix_group({at[0][c], at[1][c], at[2][c], at[3][c]}, planes[c] + std::size_t(g) * kGroup);
      continue;
    }
    for (int i = 0; i < kGroup; ++i) {
      for (int c = 0; c < 3; ++c) planes[c][std::size_t(g) * kGroup + i] = table.rows[row[i]][c];
    }
  }
}

Gloss::Gloss(const Lighting& lighting) {
  double least = 1;
  for (const Lighting::Lobe& lobe : lighting.gloss) {
    if (lobe.strength > kLeastGloss)
      least = std::min(least, std::pow(kLeastGloss / lobe.strength, 1 / lobe.exponent));
  }
  if (!(least < 1)) return;
  least_cosine_ = static_cast<float>(least);
  inverse_range_ = static_cast<float>(1 / (1 - least));
  least_near_cosine_ =
      std::cos(std::min(std::acos(least_cosine_) + kLean, std::numbers::pi_v<float>));
  for (int step = 0; step <= kSteps; ++step) {
    const double share = double(step) / kSteps, cosine = 1 - share * share * (1 - least);
    double sum = 0;
    for (const Lighting::Lobe& lobe : lighting.gloss)
      sum += lobe.strength * std::pow(cosine, lobe.exponent);
    table_[step] = static_cast<float>(sum);
  }
  table_.back() = 0;  // so that what is not seen needs no branch
  for (const Lighting::Lamp& lamp : lighting.lamps)
    lamps_.push_back({lamp.toward.cast<float>(), lamp.color.cast<float>()});
}

void Gloss::shine(const SkinDirections& normals, const SkinDirections& toward_eye, int count,
                  SkinPlanes<3>& gloss) const {
  for (auto& channel : gloss.of) std::fill_n(channel, count, 0.0f);
  // Where the loop's conditions could hide a load, it would not vectorise.
  const float least_cosine = least_cosine_, inverse_range = inverse_range_;
  for (const Lamp& lamp : lamps_) {
    const float lx = lamp.toward.x(), ly = lamp.toward.y(), lz = lamp.toward.z();
    alignas(32) float place[kSpan], share[kSpan];
    for (int i = 0; i < count; ++i) {
      const float nx = normals.of[0][i], ny = normals.of[1][i], nz = normals.of[2][i];
      const float ex = toward_eye.of[0][i], ey = toward_eye.of[1][i], ez = toward_eye.of[2][i];
      const float inverse = 1 / std::sqrt(ex * ex + ey * ey + ez * ez);
      const float hx = lx + inverse * ex, hy = ly + inverse * ey, hz = lz + inverse * ez;
      const float along = nx * hx + ny * hy + nz * hz, facing = nx * lx + ny * ly + nz * lz;
      const float lengths = (nx * nx + ny * ny + nz * nz) * (hx * hx + hy * hy + hz * hz);
      const float cosine = along / std::sqrt(lengths);
      const bool seen = (cosine > least_cosine) & (along > 0) & (facing > 0);  // not where NaN
      const float range = seen ? (1 - cosine) * inverse_range : 1;
      place[i] = kSteps * std::sqrt(range > 0 ? range : 0);
    }
    for (int i = 0; i < count; ++i) {  // the only part that is not done for eight at once
      const int step = std::min(static_cast<int>(place[i]), kSteps - 1);
      const float low = table_[step], high = table_[step + 1];
      share[i] = low + (place[i] - static_cast<float>(step)) * (high - low);
    }
    for (int c = 0; c < 3; ++c) {
      float* const sum = gloss.of[c];
      const float color = lamp.color[c];
      for (int i = 0; i < count; ++i) sum[i] += share[i] * color;
    }
  }
}

bool Gloss::may_show(const Eigen::Vector3f& normal, const Eigen::Vector3f& toward_eye) const {
  return std::any_of(lamps_.begin(), lamps_.end(), [&](const Lamp& lamp) {
    return ordered_dot(normal, unit_vector(lamp.toward + toward_eye)) >= least_near_cosine_;
  });
}

// In plain numbers: Eigen's expressions are fused differently on another processor.
template <Eigen::Vector4f RelitSkin::Node::*number>
inline std::array<float, 4> RelitSkin::mixed(const LatticeTriangles& t, int k) const {
  constexpr bool own = number == &Node::rest_mm;
  const float a = own ? t.own_along[k] : t.along[k], d = own ? t.own_down[k] : t.down[k];
  const float rest = 1 - a - d;
  const Vector4f &corner = nodes_[t.corner[k]].*number, &below = nodes_[t.below[k]].*number,
                 &beside = nodes_[t.beside[k]].*number;
  std::array<float, 4> sum;
  for (int c = 0; c < 4; ++c) sum[c] = rest * corner[c] + a * below[c] + d * beside[c];
  return sum;
}

template <Eigen::Vector4f RelitSkin::Node::*number>
void RelitSkin::mix(const LatticeTriangles& t, int count, ShadedPosts& rows) const {
  for (int k = 0; k < count; ++k) {
    // In a register, where a row could be one of a node.
    const std::array<float, 4> sum = mixed<number>(t, k);
    std::copy(sum.begin(), sum.end(), rows.rows[k]);
  }
  Eigen::Map<Vector4f, Eigen::Aligned16>(rows.rows[count]) = Node().*number;
}

void RelitSkin::light(const SkinPixels& skin, const SparseShading& span, const SpanColors& colors,
                      ScopeSpan& from_scope) const {
  if (skin.count == 0) return;
  LatticeTriangles triangles;
  find_triangles(skin, lattice_, triangles);
  const ShadingInterpolation spread(span, skin.at, skin.count);
  ShadedPosts posts;
  mix<&Node::gain>(triangles, skin.count, posts);
  SkinPlanes<3> gains;
  spread(posts, gains.planes());
  for (int c = 0; c < 3; ++c) {
    float* const plane = colors.planes[c];
    for (int i = 0; i < colors.count; ++i) plane[i] *= gains.of[c][i];
  }
  mix<&Node::normal>(triangles, skin.count, posts);
  if (from_scope_) {
    spread(posts, from_scope.skin.normals.planes());
    return light_scope(skin, triangles, spread, colors, from_scope);
  }
  const auto shines = [&](std::uint32_t face) { return shines_[face] != 0; };
  if (std::none_of(skin.face, skin.face + skin.count, shines)) return;
  SkinDirections normals;
  spread(posts, normals.planes());
  add_gloss(normals, colors);
}

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
  const float nearest = Eigen::Map<const Eigen::ArrayXf>(colors.depth_mm, colors.count).minCoeff();
  ScopeSkinAtRest& at_rest = from_scope.at_rest;
  ShadedPosts posts;
  const auto find_places = [&] {
    mix<&Node::rest_mm>(triangles, skin.count, posts);
    spread(posts, at_rest.places_mm.planes());
  };
  const bool grain = shine_.grain_shows(nearest);
  if (grain) {
    find_places();
    shine_.add_grain(from_scope.skin, at_rest, nearest, colors);
  }
  if (!shine_.light(from_scope.skin, colors, from_scope.lit)) return;
  if (!grain) find_places();
  mix<&Node::rest_normal>(triangles, skin.count, posts);
  spread(posts, at_rest.normals.planes());
  from_scope.film_shows = shine_.film_may_show(colors.count, from_scope);
}

// By the pixel: drops are narrower than the distance of knots, and knots move over the skin.
void RelitSkin::add_film(const SkinPixels& skin, unsigned first, const SpanColors& colors,
                         ScopeSpan& from_scope) const {
  LatticeTriangles triangles;
  find_triangles(skin, lattice_, triangles);
  for (int k = 0; k < skin.count; ++k) {
    const auto normal = mixed<&Node::normal>(triangles, k),
               rest = mixed<&Node::rest_normal>(triangles, k),
               place = mixed<&Node::rest_mm>(triangles, k);
    const unsigned i = first + static_cast<unsigned>(k);
    for (int c = 0; c < 3; ++c) {
      from_scope.skin.normals.of[c][i] = normal[c];
      from_scope.at_rest.normals.of[c][i] = rest[c];
      from_scope.at_rest.places_mm.of[c][i] = place[c];
    }
    from_scope.at_rest.bends[i] = rest[3] + normal[3];
  }
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
