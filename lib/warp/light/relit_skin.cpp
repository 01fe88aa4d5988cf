// SPDX-License-Identifier: Apache-2.0
#include "warp/light/relit_skin.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "warp/light/lattice_normals.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Skin that no lamp reached tells little of what it would show in full light.
constexpr float kLargestGain = 4, kLeastLight = 1e-3f;

}  // namespace

RelitSkin::RelitSkin(const BaseLayer& layer, const ShellSurface& shell, const Lighting& lighting)
    : lattice_{layer.steps, layer.face_count, layer.height_mm, {}, {}},
      lighting_(lighting),
      gloss_(lighting),
      shine_(lighting),
      turns_(shell),
      shells_(shell_matrices(shell.at_rest())),
      turned_(layer.face_count, 0),
      shines_(layer.face_count, 0),
      to_place_(layer.face_count, 1),
      to_light_(layer.face_count, 1) {
  for (const Vector3d& normal : lattice_normals(layer, shell.at_rest())) {
    rest_normals_.push_back(normal.cast<float>());
    // Of the very number that light_face() asks for at rest: to the bit, nothing is lit anew there.
    rest_light_.push_back(light_on(rest_normals_.back().cast<double>()));
  }
  places_.resize(rest_normals_.size());
  nodes_.resize(rest_normals_.size());
}

void RelitSkin::turn(const std::vector<ShellMatrix>& deformed, std::vector<std::uint8_t>& moved) {
  std::vector<std::uint8_t> changed(shells_.size()), turned(shells_.size());
  for (std::size_t f = 0; f < shells_.size(); ++f) changed[f] = deformed[f] != shells_[f];
  turns_.place(deformed, changed, turned);
  for (std::size_t f = 0; f < shells_.size(); ++f) {
    to_place_[f] |= changed[f];
    to_light_[f] |= turned[f];
    if (!moved.empty()) moved[f] |= turned[f];
  }
  shells_ = deformed;
}

// Another light than the last time finds every face unlit.
void RelitSkin::light_by(bool scope) {
  if (scope == from_scope_) return;
  from_scope_ = scope;
  std::fill(to_light_.begin(), to_light_.end(), std::uint8_t{1});
}

// What the relief is bound to, worked out when the light at the scope is first asked for.
void RelitSkin::place_rest_nodes() {
  rest_nodes_.resize(nodes_.size());
  const std::uint32_t n = lattice_.steps;
  parallel_for(std::uint32_t{0}, lattice_.face_count, [&](std::uint32_t f) {
    each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      const std::size_t at = first_node(f) + node;
      const Vector3d place =
          shell_point(turns_.rest()[f], double(i) / n, double(j) / n, lattice_.height_mm[at]);
      auto& mixed = rest_nodes_[at].mixed;
      Eigen::Map<Vector3f>(mixed.data()) = rest_normals_[at];
      Eigen::Map<Vector3f>(mixed.data() + 3) = place.cast<float>();
    });
  });
}

void RelitSkin::light_faces_from_scope(const View& view, double reference_mm,
                                       const std::vector<std::uint8_t>& shown) {
  light_by(true);
  shine_.look(view, reference_mm);
  if (rest_nodes_.empty()) place_rest_nodes();
  parallel_for(std::uint32_t{0}, lattice_.face_count, [&](std::uint32_t f) {
    if (shown[f] && std::exchange(to_light_[f], 0)) light_face(f);
  });
}

void RelitSkin::light_faces(const View& view, const std::vector<std::uint8_t>& shown) {
  light_by(false);
  const Eigen::Matrix3d world_from_view = view.camera.camera_from_world.rotation.transpose();
  const Intrinsics& k = view.camera.intrinsics;
  ray_right_ = (world_from_view.col(0) / k.fx).cast<float>();
  ray_down_ = (world_from_view.col(1) / k.fy).cast<float>();
  ray_origin_ = world_from_view.col(2).cast<float>() - static_cast<float>(k.cx) * ray_right_ -
                static_cast<float>(k.cy) * ray_down_;
  const Vector3f eye = view.camera.center_world_mm().cast<float>();
  parallel_for(std::uint32_t{0}, lattice_.face_count, [&](std::uint32_t f) {
    if (!shown[f]) return;
    if (std::exchange(to_light_[f], 0)) light_face(f);
    if (gloss_.none()) return;
    if (std::exchange(to_place_[f], 0)) place_face(f);
    shines_[f] = may_shine(f, eye);
  });
}

void RelitSkin::place_face(std::uint32_t face) {
  const std::uint32_t n = lattice_.steps;
  each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
    const std::size_t at = first_node(face) + node;
    places_[at] = shell_point(shells_[face], double(i) / n, double(j) / n, lattice_.height_mm[at])
                      .cast<float>();
  });
}

Vector3f RelitSkin::light_on(const Vector3d& normal) const {
  return lighting_.diffuse(normal).cast<float>().cwiseMax(kLeastLight);
}

void RelitSkin::light_face(std::uint32_t face) {
  const std::uint32_t n = lattice_.steps;
  const float step = 1 / static_cast<float>(n);
  const bool at_rest = turns_.at_rest(face);
  const NormalTransport::OnFace turns = turns_.on(face);
  turned_[face] = from_scope_;
  each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
    const std::size_t at = first_node(face) + node;
    Vector3f normal = rest_normals_[at];
    if (!at_rest) {
      const NormalTransport::FloatTurn turn =
          turns.at(step * static_cast<float>(i), step * static_cast<float>(j));
      normal = (turn * normal).eval().head<3>().normalized();
    }
    nodes_[at].normal() = normal;
    if (from_scope_) {
      nodes_[at].gain() = rest_light_[at].cwiseInverse().cwiseMin(kLargestGain);
      return;
    }
    const Vector3f gain = light_on(normal.cast<double>()).cwiseQuotient(rest_light_[at]);
    nodes_[at].gain() = gain.cwiseMin(kLargestGain);
    turned_[face] |= nodes_[at].gain() != Vector3f::Ones();
  });
}

// Where a view can see gloss: on faces with a node whose normal is near enough to half-way.
bool RelitSkin::may_shine(std::uint32_t face, const Vector3f& eye) const {
  const std::size_t first = first_node(face);
  for (std::size_t at = first; at < first + lattice_.nodes_per_face(); ++at) {
    if (gloss_.may_show(nodes_[at].normal(), (eye - places_[at]).normalized())) return true;
  }
  return false;
}

// Each pixel's lattice triangle: the one that holds its place, or the nearest for a place outside
// the face. By its nodes, and the weights of the second and the third.
struct RelitSkin::Triangles {
  alignas(32) std::int32_t corner[kStretch], below[kStretch], beside[kStretch];
  alignas(32) float along[kStretch], down[kStretch];
};

void RelitSkin::find_triangles(const SkinPixels& skin, Triangles& out) const {
  const auto steps = static_cast<std::int32_t>(lattice_.steps);
  const auto nodes_per_face = static_cast<std::int32_t>(lattice_.nodes_per_face());
  const auto n = static_cast<float>(steps);
  const auto in_unit = [](float v) { return v > 0 ? (v < 1 ? v : 1) : 0; };
  const auto index = [&](std::int32_t i, std::int32_t j) {
    return static_cast<std::int32_t>(
        base_node_index(lattice_.steps, std::uint32_t(i), std::uint32_t(j)));
  };
  for (int k = 0; k < skin.count; ++k) {
    const float u = in_unit(skin.b1[k]) * n, v = in_unit(skin.b2[k]) * n;
    const auto cell_u = static_cast<std::int32_t>(u), cell_v = static_cast<std::int32_t>(v);
    const std::int32_t i = cell_u < steps - 1 ? cell_u : steps - 1;
    const std::int32_t j = cell_v < steps - 1 - i ? cell_v : steps - 1 - i;
    const float along = in_unit(u - static_cast<float>(i));
    const float down = in_unit(v - static_cast<float>(j));
    // The quad's other triangle, from its far corner; on the face's long edge there is none.
    const bool beyond = along + down > 1, other = beyond & (i + j + 2 <= steps);
    const float scale = beyond ? 1 / (along + down) : 1;
    out.along[k] = other ? 1 - down : scale * along;
    out.down[k] = other ? 1 - along : scale * down;
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

void RelitSkin::light(const SkinPixels& skin, const SparseShading& stretch,
                      const StretchColors& colors) const {
  if (skin.count == 0) return;
  Triangles triangles;
  find_triangles(skin, triangles);
  ShadedPosts mixed;
  mix_nodes(nodes_, Node(), triangles, skin.count, mixed);
  const ShadingInterpolation spread(stretch, skin.at, skin.count);
  SkinPlanes<3> gains;
  spread(mixed, 0, gains.planes());
  for (int c = 0; c < 3; ++c) {
    float* const plane = colors.planes[c];
    for (int i = 0; i < colors.count; ++i) plane[i] *= gains.of[c][i];
  }
  if (from_scope_) {
    ScopeSkin scope_skin;
    spread(mixed, 3, scope_skin.normals.planes());
    return light_scope(skin, triangles, spread, scope_skin, colors);
  }
  const auto shines = [&](std::uint32_t face) { return shines_[face] != 0; };
  if (std::none_of(skin.face, skin.face + skin.count, shines)) return;
  SkinDirections normals;
  spread(mixed, 3, normals.planes());
  add_gloss(normals, colors);
}

// Where skin lies at rest is asked for only where gloss may show: the relief is bound to it.
void RelitSkin::light_scope(const SkinPixels& skin, const Triangles& triangles,
                            const ShadingInterpolation& spread, ScopeSkin& scope_skin,
                            const StretchColors& colors) const {
  std::fill_n(scope_skin.depth_mm, kStretch, 1.0f);
  for (int i = 0; i < colors.count; ++i) {
    const float depth = colors.depth_mm[i];
    scope_skin.depth_mm[i] = depth < std::numeric_limits<float>::infinity() ? depth : 1;
  }
  ScopeLit lit;
  if (!shine_.light(scope_skin, colors, lit)) return;
  ShadedPosts mixed;
  mix_nodes(rest_nodes_, RestNode(), triangles, skin.count, mixed);
  ScopeSkinAtRest at_rest;
  spread(mixed, 0, at_rest.normals.planes());
  spread(mixed, 3, at_rest.places_mm.planes());
  shine_.add_gloss(lit, scope_skin, at_rest, colors);
}

// By the pixel: a highlight may be narrower than the distance of posts.
void RelitSkin::add_gloss(const SkinDirections& normals, const StretchColors& colors) const {
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
