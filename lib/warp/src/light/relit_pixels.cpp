// SPDX-License-Identifier: Apache-2.0
// RelitSkin by the pixel: light is found at a span's knots and spread between them, gloss for every
// pixel. What it does by the node, in Eigen's words, is in relit_skin.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
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
    first_knot_[first / kGroup] = knot_count_;
    smooth_[first / kGroup] = first + kGroup <= count && all_run_on(&runs_on[first]);
    if (smooth_[first / kGroup]) {
      for (const int at : kKnots) knots_[knot_count_++] = first + at;
      continue;
    }
    for (int i = first; i < std::min(first + kGroup, count); ++i) {
      knots_[knot_count_] = i;
      knot_count_ += depth_mm[i] < kInfinity;
    }
  }
  first_knot_[groups()] = knot_count_;
}

void SparseShading::mix(int g, const float* of_knots, float* __restrict group) const {
  const int first = first_knot_[g];
  if (smooth_[g]) {
    const float* const at = of_knots + first;
    return mix_group({at[0], at[1], at[2], at[3]}, group);
  }
  std::fill_n(group, kGroup, 0.f);
  for (int k = first; k < first_knot_[g + 1]; ++k) group[knots_[k] - g * kGroup] = of_knots[k];
}

void SparseShading::mix(const SkinPlanes<3>& of_knots, SkinPlanes<3>& span) const {
  for (int c = 0; c < 3; ++c)
    for (int g = 0; g < groups(); ++g) mix(g, of_knots.of[c], span.of[c] + g * kGroup);
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
void RelitSkin::mix(const LatticeTriangles& t, int count, SkinPlanes<3>& planes,
                    float* fourth) const {
  constexpr bool own = number == &Node::rest_mm;
  alignas(16) float rows[kSpan][4];  // four at once, then taken apart
  for (unsigned k = 0; k < whole_vectors(count); ++k) {
    const float a = own ? t.own_along[k] : t.along[k], d = own ? t.own_down[k] : t.down[k];
    const Vector4f &corner = nodes_[t.corner[k]].*number, &below = nodes_[t.below[k]].*number,
                   &beside = nodes_[t.beside[k]].*number;
    std::array<float, 4> sum;  // equal numbers stay what they are
    for (int c = 0; c < 4; ++c)
      sum[c] = corner[c] + a * (below[c] - corner[c]) + d * (beside[c] - corner[c]);
    std::copy(sum.begin(), sum.end(), rows[k]);
  }
  const auto take = [&](int c, float* __restrict plane) {
    for (unsigned k = 0; k < whole_vectors(count); ++k) plane[k] = rows[k][c];
  };
  for (int c = 0; c < 3; ++c) take(c, planes.of[c]);
  if (fourth) take(3, fourth);
}

int RelitSkin::light(const SkinPixels& knots, const SparseShading& span, const SpanColors& colors,
                     std::int32_t* film_at) const {
  if (std::all_of(knots.face, knots.face + knots.count, [&](auto f) { return unchanged(f); }))
    return 0;
  LatticeTriangles triangles;
  find_triangles(knots, lattice_, triangles);
  if (from_scope_) return light_scope(knots, triangles, span, colors, film_at);
  SkinPlanes<3> gains;
  mix<&Node::gain>(triangles, knots.count, gains);
  for (int g = 0; g < span.groups(); ++g) {
    for (int c = 0; c < 3; ++c) {
      alignas(64) float gain[kGroup];
      span.mix(g, gains.of[c], gain);
      float* const plane = colors.planes[c] + g * kGroup;
#pragma GCC unroll 1
      for (int i = 0; i < kGroup; ++i) plane[i] *= gain[i];
    }
  }
  const auto shines = [&](std::uint32_t face) { return shines_[face] != 0; };
  if (std::none_of(knots.face, knots.face + knots.count, shines)) return 0;
  SkinDirections of_knots, normals;
  mix<&Node::normal>(triangles, knots.count, of_knots);
  span.mix(of_knots, normals);
  add_gloss(normals, colors);
  return 0;
}

namespace {

// Colours by their light, which is mixed from that of the knots.
void take_light(const SparseShading& span, const ScopeLit& lit, const SpanColors& colors) {
  for (int g = 0; g < span.groups(); ++g) {
    alignas(64) float rim[kGroup], sheen[kGroup], times[kGroup];
    span.mix(g, lit.rim, rim);
    span.mix(g, lit.sheen, sheen);
    const float* const white = colors.white + g * kGroup;
    for (int c = 0; c < 3; ++c) {
      span.mix(g, lit.times.of[c], times);
      float* const plane = colors.planes[c] + g * kGroup;
#pragma GCC unroll 1
      for (int i = 0; i < kGroup; ++i)
        plane[i] =
            plane[i] * times[i] + white[i] * (rim[i] + ScopeShine::kSheen[c] * sheen[i]);
    }
  }
}

}  // namespace

// Where skin lies at rest is asked for only where film or grain may show: both are bound to it.
int RelitSkin::light_scope(const SkinPixels& knots, const LatticeTriangles& triangles,
                           const SparseShading& span, const SpanColors& colors,
                           std::int32_t* film_at) const {
  ScopeSkin skin;
  skin.count = knots.count;
  skin.row = static_cast<float>(colors.y) + 0.5f;
  for (unsigned k = 0; k < whole_vectors(knots.count); ++k) {
    skin.column[k] = static_cast<float>(colors.x0 + knots.at[k]) + 0.5f;
    skin.depth_mm[k] = colors.depth_mm[knots.at[k]];
  }
  const float nearest = Eigen::Map<const Eigen::ArrayXf>(skin.depth_mm, knots.count).minCoeff();
  ScopeLit lit;
  mix<&Node::gain>(triangles, knots.count, lit.times);
  mix<&Node::normal>(triangles, knots.count, skin.normals);
  shine_.light(skin, lit);
  const bool grain = shine_.grain().shows(nearest, shine_.view().inverse_pixel);
  const bool film = std::any_of(lit.film_near, lit.film_near + knots.count, std::identity());
  if (grain || film) mix<&Node::rest_mm>(triangles, knots.count, skin.rest_mm);
  if (grain) {
    SkinDirections rest_mm;
    span.mix(skin.rest_mm, rest_mm);
    shine_.grain().add(rest_mm, shine_.view().inverse_pixel, nearest, colors);
  }
  take_light(span, lit, colors);
  if (!film) return 0;
  mix<&Node::rest_normal>(triangles, knots.count, skin.rest_normals, skin.bends);
  return find_film(skin, lit, span, colors, film_at);
}

// Of the groups with a knot that a film may show near, the pixels where it may be lit.
int RelitSkin::find_film(const ScopeSkin& knots, const ScopeLit& lit, const SparseShading& span,
                         const SpanColors& colors, std::int32_t* film_at) const {
  ScopeSkin skin;
  skin.row = knots.row;
  std::array<int, kSpan / kGroup> groups;
  for (int g = 0; g < span.groups(); ++g) {
    const std::int32_t* const near = lit.film_near;
    if (std::none_of(near + span.first_knot(g), near + span.first_knot(g + 1), std::identity()))
      continue;
    groups[skin.count / kGroup] = g;
    const auto mix = [&](const float* of_knots, float* plane) {
      span.mix(g, of_knots, plane + skin.count);
    };
    mix(knots.column, skin.column), mix(knots.depth_mm, skin.depth_mm);
    mix(knots.bends, skin.bends);
    for (int c = 0; c < 3; ++c) {
      mix(knots.normals.of[c], skin.normals.of[c]);
      mix(knots.rest_normals.of[c], skin.rest_normals.of[c]);
      mix(knots.rest_mm.of[c], skin.rest_mm.of[c]);
    }
    skin.count += kGroup;
  }
  alignas(64) std::int32_t may_be_lit[kSpan];
  shine_.film().find_lit(shine_.view(), skin, may_be_lit);
  int count = 0;
  for (int i = 0; i < skin.count; ++i) {
    film_at[count] = groups[i / kGroup] * kGroup + i % kGroup;
    count += may_be_lit[i] && film_at[count] < colors.count &&
             colors.depth_mm[film_at[count]] < std::numeric_limits<float>::infinity();
  }
  return count;
}

// By the pixel: drops are narrower than the distance of knots, and knots move over the skin.
void RelitSkin::add_film(const SkinPixels& pixels, const SpanColors& colors) const {
  LatticeTriangles triangles;
  find_triangles(pixels, lattice_, triangles);
  ScopeSkin skin;
  skin.count = pixels.count;
  skin.row = static_cast<float>(colors.y) + 0.5f;
  float more_bent[kSpan];
  mix<&Node::normal>(triangles, pixels.count, skin.normals, more_bent);
  mix<&Node::rest_normal>(triangles, pixels.count, skin.rest_normals, skin.bends);
  mix<&Node::rest_mm>(triangles, pixels.count, skin.rest_mm);
  for (unsigned k = 0; k < whole_vectors(pixels.count); ++k) {
    skin.column[k] = static_cast<float>(colors.x0 + pixels.at[k]) + 0.5f;
    skin.depth_mm[k] = colors.depth_mm[pixels.at[k]];
    skin.bends[k] += more_bent[k];
  }
  shine_.film().add(shine_.view(), skin, pixels.at, colors);
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
