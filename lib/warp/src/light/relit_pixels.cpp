// SPDX-License-Identifier: Apache-2.0
// RelitSkin by the pixel: light is found at a span's knots and spread between them, gloss for every
// pixel. What it does by the node, in Eigen's words, is in relit_skin.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "light/relit_skin.h"

namespace organbake {

using Eigen::Vector3f;
using Eigen::Vector4f;

// Each pixel's lattice triangle: the one that holds its place, or the nearest for a place outside
// the face, as a sample's on its edge may show it. By its nodes, and the weights of the second and
// the third at the nearest place within, and where the pixel's own lies. Light ends at the edge:
// normals that went on would lean on beyond it, where the next face's do not. Places at rest go on.
struct LatticeTriangles {
  alignas(64) std::int32_t corner[kMostSkin], below[kMostSkin], beside[kMostSkin];
  alignas(64) float along[kMostSkin], down[kMostSkin], own_along[kMostSkin], own_down[kMostSkin];
};

namespace {

constexpr int kGroup = SparseShading::kGroup;
// visit(plane, white, channel, first) for each row of each plane of group g; first: of its numbers.
template <class Visit>
void each_row(int g, std::span<const SpanColors> rows, const Visit& visit) {
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (int c = 0; c < 3; ++c)
      visit(rows[r].planes[c] + g * kGroup, rows[r].white + g * kGroup, c,
            static_cast<int>(r) * kGroup);
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

void Gloss::shine(const SkinPlanes& normals, const SkinPlanes& toward_eye, int count,
                  SkinPlanes& gloss) const {
  for (float* const channel : gloss.planes()) std::fill_n(channel, count, 0.0f);
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

// In plain numbers: Eigen's expressions are fused differently on another processor. Four of them at
// once, then taken apart.
template <Eigen::Vector4f RelitSkin::Node::*... numbers>
void RelitSkin::mix(const LatticeTriangles& t, int count,
                    const std::array<SkinPlanes*, sizeof...(numbers)>& planes) const {
  alignas(16) float rows[sizeof...(numbers)][kMostSkin][4];
  for (unsigned k = 0; k < whole_vectors(count); ++k) {
    const Node &corner = nodes_[t.corner[k]], &below = nodes_[t.below[k]],
               &beside = nodes_[t.beside[k]];
    const auto put = [&](Vector4f Node::*number, bool own, float* row) {
      const float a = own ? t.own_along[k] : t.along[k], d = own ? t.own_down[k] : t.down[k];
      const Vector4f &from = corner.*number, &there = below.*number, &aside = beside.*number;
      std::array<float, 4> sum;  // equal numbers stay what they are
      for (int c = 0; c < 4; ++c)
        sum[c] = from[c] + a * (there[c] - from[c]) + d * (aside[c] - from[c]);
      std::copy(sum.begin(), sum.end(), row);
    };
    int n = 0;
    (put(numbers, numbers == &Node::rest_mm, rows[n++][k]), ...);
  }
  for (std::size_t n = 0; n < planes.size(); ++n) {
    auto& __restrict of = planes[n]->of;
    for (unsigned k = 0; k < whole_vectors(count); ++k)
      for (int c = 0; c < 4; ++c) of[c][k] = rows[n][k][c];
  }
}

int RelitSkin::light(const SkinPixels& knots, SparseShading& span, std::span<const SpanColors> rows,
                     std::int32_t* film_at) const {
  if (std::all_of(knots.face, knots.face + knots.count, [&](auto f) { return unchanged(f); }))
    return 0;
  LatticeTriangles triangles;
  find_triangles(knots, lattice_, triangles);
  if (from_scope_) return light_scope(knots, triangles, span, rows, film_at);
  SkinPlanes gains, normals;
  mix<&Node::gain, &Node::normal>(triangles, knots.count, {&gains, &normals});
  const auto shines = [&](std::uint32_t face) { return shines_[face] != 0; };
  for (int g = 0; g < span.groups(); ++g) {
    SkinPlanes gain, normal;
    span.mix(g, gains, gain);
    each_row(g, rows, [&](float* plane, const float*, int c, int first) {
      for (int i = 0; i < kGroup; ++i) plane[i] *= gain.of[c][first + i];
    });
    // Group by group, which are the same whatever part of the picture is drawn.
    const std::uint32_t* const face = knots.face;
    if (std::none_of(face + span.first_knot(g), face + span.first_knot(g + 1), shines)) continue;
    span.mix(g, normals, normal);
    add_gloss(g, normal, rows);
  }
  return 0;
}

// Groups' colours by their light, which is mixed from that of the knots; and of the groups with a
// knot that a film may show near, the pixels where it may be lit.
int RelitSkin::light_scope(const SkinPixels& pixels, const LatticeTriangles& triangles,
                           SparseShading& span, std::span<const SpanColors> rows,
                           std::int32_t* film_at) const {
  ScopeSkin knots, skin;
  knots.count = pixels.count;
  for (unsigned k = 0; k < whole_vectors(pixels.count); ++k) knots.place(k, pixels.at[k], rows);
  ScopeLit lit;
  mix<&Node::gain, &Node::normal, &Node::rest_normal, &Node::rest_mm>(
      triangles, pixels.count, {&lit.times, &knots.normals, &knots.rest_normals, &knots.rest_mm});
  shine_.light(knots, lit);
  if (span.refine(lit.times.of[1])) return kAskAnew;
  const float nearest = Eigen::Map<const Eigen::ArrayXf>(knots.depth_mm, knots.count).minCoeff();
  const float inverse_pixel = shine_.view().inverse_pixel;
  const bool grain = shine_.grain().shows(nearest, inverse_pixel);
  std::array<int, kSpan / kGroup> groups;
  for (int g = 0; g < span.groups(); ++g) {
    const std::int32_t* const near = lit.film_near;
    const bool film =
        std::any_of(near + span.first_knot(g), near + span.first_knot(g + 1), std::identity());
    SkinPlanes times;
    alignas(64) float rim[SparseShading::kPixels], sheen[SparseShading::kPixels];
    span.mix(g, lit.times, times);
    span.mix(g, lit.rim, rim), span.mix(g, lit.sheen, sheen);
    if (grain || film) {
      span.mix(g, knots.rest_mm, skin.rest_mm, skin.count);
      span.mix(g, knots.depth_mm, skin.depth_mm + skin.count);
    }
    if (grain) shine_.grain().multiply(skin, skin.count, nearest, inverse_pixel, times);
    each_row(g, rows, [&](float* plane, const float* white, int c, int first) {
#pragma GCC unroll 1
      for (int i = 0; i < kGroup; ++i)
        plane[i] = plane[i] * times.of[c][first + i] +
                   white[i] * (rim[first + i] + ScopeShine::kSheen[c] * sheen[first + i]);
    });
    if (!film) continue;
    groups[skin.count / SparseShading::kPixels] = g;
    span.mix(g, knots.column, skin.column + skin.count);
    span.mix(g, knots.row, skin.row + skin.count);
    span.mix(g, knots.normals, skin.normals, skin.count);
    span.mix(g, knots.rest_normals, skin.rest_normals, skin.count);
    span.mix(g, knots.rest_normals.of[3], skin.rest_normals.of[3] + skin.count);
    skin.count += SparseShading::kPixels;
  }
  if (skin.count == 0) return 0;
  alignas(64) std::int32_t may_be_lit[kMostSkin];
  shine_.film().find_lit(shine_.view(), skin, may_be_lit);
  int count = 0;
  for (unsigned k = 0; k < static_cast<unsigned>(skin.count); ++k) {
    if (!may_be_lit[k]) continue;
    const int r = static_cast<int>(k % SparseShading::kPixels / kGroup);
    const int i = groups[k / SparseShading::kPixels] * kGroup + static_cast<int>(k % kGroup);
    film_at[count] = r * kSpan + i;
    count += r < span.rows() && i < rows[r].count &&
             rows[r].depth_mm[i] < std::numeric_limits<float>::infinity();
  }
  return count;
}

// By the pixel: drops are narrower than the distance of knots, and knots move over the skin.
void RelitSkin::add_film(const SkinPixels& pixels, std::span<const SpanColors> rows) const {
  LatticeTriangles triangles;
  find_triangles(pixels, lattice_, triangles);
  ScopeSkin skin;
  skin.count = pixels.count;
  mix<&Node::normal, &Node::rest_normal, &Node::rest_mm>(
      triangles, pixels.count, {&skin.normals, &skin.rest_normals, &skin.rest_mm});
  for (unsigned k = 0; k < whole_vectors(pixels.count); ++k) {
    skin.place(k, pixels.at[k], rows);
    skin.rest_normals.of[3][k] += skin.normals.of[3][k];
  }
  shine_.film().add(shine_.view(), skin, pixels.at, rows);
}

// By the pixel: a highlight may be narrower than the distance of knots.
void RelitSkin::add_gloss(int g, const SkinPlanes& normals,
                          std::span<const SpanColors> rows) const {
  const ScopeView& view = shine_.view();
  SkinPlanes toward_eye, gloss;
  for (int k = 0; k < SparseShading::kPixels; ++k) {
    const float column = static_cast<float>(rows[0].x0 + g * kGroup + k % kGroup) + 0.5f;
    const float row = static_cast<float>(rows[0].y + k / kGroup) + 0.5f;
    for (int c = 0; c < 3; ++c)
      toward_eye.of[c][k] = -(view.origin[c] + row * view.down[c] + column * view.right[c]);
  }
  gloss_.shine(normals, toward_eye, SparseShading::kPixels, gloss);
  each_row(g, rows, [&](float* plane, const float* white, int c, int first) {
    for (int i = 0; i < kGroup; ++i) plane[i] += white[i] * gloss.of[c][first + i];
  });
}

}  // namespace organbake
