// SPDX-License-Identifier: Apache-2.0
#include "warp/relit_skin.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Skin that no lamp reached tells little of what it would show in full light.
constexpr float kLargestGain = 4, kLeastLight = 1e-3f;

// A lattice's nodes as a visitor sees them: their place on the face.
template <class Visit>
void each_node(std::uint32_t steps, Visit&& visit) {
  for (std::uint32_t i = 0; i <= steps; ++i)
    for (std::uint32_t j = 0; i + j <= steps; ++j) visit(i, j, base_node_index(steps, i, j));
}

// A node on a face's rim by what its neighbours know it as: the edge's vertices, the smaller first,
// and its steps from the second; a corner is the vertex twice.
using RimNode = std::array<std::uint32_t, 3>;

// Nothing for a node inside the face.
std::optional<RimNode> rim_node(const Face& face, std::uint32_t steps, std::uint32_t i,
                                std::uint32_t j) {
  const std::array<std::uint32_t, 3> steps_from = {steps - i - j, i, j};
  for (int k = 0; k < 3; ++k) {
    if (steps_from[k] == steps) return RimNode{face[k], face[k], 0};
  }
  for (int k = 0; k < 3; ++k) {
    if (steps_from[k] > 0) continue;
    const int a = (k + 1) % 3, b = (k + 2) % 3;  // the edge's ends
    return face[a] < face[b] ? RimNode{face[a], face[b], steps_from[a]}
                             : RimNode{face[b], face[a], steps_from[b]};
  }
  return std::nullopt;
}

}  // namespace

RelitSkin::RelitSkin(const BaseLayer& layer, const TriangleMesh& proxy, const Lighting& lighting)
    : lattice_{layer.steps, layer.face_count, layer.height_mm, {}, {}},
      lighting_(lighting),
      gloss_(lighting),
      placed_(shell_matrices(proxy)),
      own_normals_(std::size_t(layer.face_count) * layer.nodes_per_face()),
      places_(own_normals_.size()),
      rest_light_(own_normals_.size()),
      nodes_(own_normals_.size()),
      turned_(layer.face_count, 0),
      shines_(layer.face_count, 0) {
  number_rim(proxy);
  for (std::uint32_t f = 0; f < layer.face_count; ++f) raise_face(f);
  join();
  for (std::uint32_t f = 0; f < layer.face_count; ++f) light_face(f, true);
}

void RelitSkin::number_rim(const TriangleMesh& proxy) {
  std::map<RimNode, std::uint32_t> numbers;
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    each_node(lattice_.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      const auto rim = rim_node(proxy.faces[f], lattice_.steps, i, j);
      if (!rim) return;
      const auto next = static_cast<std::uint32_t>(numbers.size());
      rim_.push_back({first_node(f) + node, numbers.try_emplace(*rim, next).first->second});
    });
  }
  joined_.resize(numbers.size());
}

void RelitSkin::place(const std::vector<ShellMatrix>& deformed, const View& view,
                      std::vector<std::uint8_t>& moved) {
  const Eigen::Matrix3d world_from_view = view.camera.camera_from_world.rotation.transpose();
  const Intrinsics& k = view.camera.intrinsics;
  ray_right_ = (world_from_view.col(0) / k.fx).cast<float>();
  ray_down_ = (world_from_view.col(1) / k.fy).cast<float>();
  ray_origin_ = world_from_view.col(2).cast<float>() - static_cast<float>(k.cx) * ray_right_ -
                static_cast<float>(k.cy) * ray_down_;
  std::vector<std::uint8_t> relit(placed_.size());
  tbb::parallel_for(std::uint32_t{0}, lattice_.face_count, [&](std::uint32_t f) {
    relit[f] = deformed[f] != placed_[f];
    if (!relit[f]) return;
    placed_[f] = deformed[f];
    raise_face(f);
  });
  if (std::find(relit.begin(), relit.end(), 1) != relit.end()) relight(relit, moved);
  if (gloss_.none()) return;
  const Vector3f eye = view.camera.center_world_mm().cast<float>();
  tbb::parallel_for(std::uint32_t{0}, lattice_.face_count,
                    [&](std::uint32_t f) { shines_[f] = may_shine(f, eye); });
}

// Of the faces in `relit`, and of those that a join changes; these are added to `moved`.
void RelitSkin::relight(std::vector<std::uint8_t>& relit, std::vector<std::uint8_t>& moved) {
  // A face that stayed takes new normals along the edges that it shares with one that moved.
  const std::vector<Vector3d> before = joined_;
  join();
  const std::size_t rim_of_face = rim_.size() / placed_.size();
  tbb::parallel_for(std::uint32_t{0}, lattice_.face_count, [&](std::uint32_t f) {
    for (std::size_t r = f * rim_of_face; !relit[f] && r < (f + 1) * rim_of_face; ++r)
      relit[f] = before[rim_[r].number] != joined_[rim_[r].number];
    if (!relit[f]) return;
    light_face(f, false);
    if (!moved.empty()) moved[f] = 1;
  });
}

// The lattice's normals over one face: those of its small triangles, by area, at their corners.
void RelitSkin::raise_face(std::uint32_t face) {
  const std::uint32_t n = lattice_.steps;
  std::vector<Vector3d> points(lattice_.nodes_per_face());
  Vector3d* const normals = &own_normals_[first_node(face)];
  each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
    points[node] = shell_point(placed_[face], double(i) / n, double(j) / n,
                               lattice_.height_mm[first_node(face) + node]);
    places_[first_node(face) + node] = points[node].cast<float>();
    normals[node].setZero();
  });
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vector3d normal = (points[b] - points[a]).cross(points[c] - points[a]);
    for (const std::uint32_t node : {a, b, c}) normals[node] += normal;
  };
  each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
    if (i + j + 1 > n) return;
    const std::uint32_t down = base_node_index(n, i + 1, j), right = base_node_index(n, i, j + 1);
    add(node, down, right);
    if (i + j + 2 <= n) add(down, base_node_index(n, i + 1, j + 1), right);
  });
}

// Nodes that faces share get one normal: the light must not break at an edge.
void RelitSkin::join() {
  std::fill(joined_.begin(), joined_.end(), Vector3d::Zero());
  for (const Rim& rim : rim_) joined_[rim.number] += own_normals_[rim.node];
}

void RelitSkin::light_face(std::uint32_t face, bool at_rest) {
  const auto light = [&](std::size_t at, const Vector3d& sum) {
    const Vector3d normal = sum.stableNormalized();
    const Vector3f light = lighting_.diffuse(normal).cast<float>().cwiseMax(kLeastLight);
    if (at_rest) rest_light_[at] = light;
    nodes_[at].gain() = light.cwiseQuotient(rest_light_[at]).cwiseMin(kLargestGain);
    nodes_[at].normal() = normal.cast<float>();
  };
  const std::size_t first = first_node(face), end = first + lattice_.nodes_per_face();
  for (std::size_t at = first; at < end; ++at) light(at, own_normals_[at]);
  const std::size_t rim_of_face = rim_.size() / placed_.size();
  for (std::size_t r = face * rim_of_face; r < (face + 1) * rim_of_face; ++r)
    light(rim_[r].node, joined_[rim_[r].number]);
  turned_[face] = !std::all_of(nodes_.begin() + first, nodes_.begin() + end,
                               [](const Node& node) { return node.gain() == Vector3f::Ones(); });
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
  alignas(32) std::int32_t corner[SkinPixels::kMost], below[SkinPixels::kMost],
      beside[SkinPixels::kMost];
  alignas(32) float along[SkinPixels::kMost], down[SkinPixels::kMost];
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

void RelitSkin::mix_nodes(const SkinPixels& skin, MixedNodes& out) const {
  Triangles t;
  find_triangles(skin, t);
  for (int k = 0; k < skin.count; ++k) {
    const float along = t.along[k], down = t.down[k], rest = 1 - along - down;
    const auto& corner = nodes_[t.corner[k]].mixed;
    const auto& below = nodes_[t.below[k]].mixed;
    const auto& beside = nodes_[t.beside[k]].mixed;
    for (int c = 0; c < 8; ++c)
      out.of[k][c] = rest * corner[c] + along * below[c] + down * beside[c];
  }
}

void RelitSkin::light(const SkinPixels& skin, int y, const ColorRow& row) const {
  if (skin.count == 0) return;
  SkinLight light;
  find_light(skin, y, light);
  float* const planes[3] = {row.red, row.green, row.blue};
  for (int k = 0; k < skin.count; ++k) {
    const int i = skin.column[k] - row.first_column;
    for (int c = 0; c < 3; ++c)
      planes[c][i] = planes[c][i] * light.gain[c][k] + skin.white[k] * light.gloss[c][k];
  }
}

void RelitSkin::find_light(const SkinPixels& skin, int y, SkinLight& light) const {
  MixedNodes mixed;
  mix_nodes(skin, mixed);
  bool shines = false;
  for (int k = 0; k < skin.count; ++k) {
    shines |= shines_[skin.face[k]] != 0;
    for (int c = 0; c < 3; ++c) light.gain[c][k] = mixed.of[k][c];
  }
  if (shines) return add_gloss(skin, y, mixed, light);
  for (auto& channel : light.gloss) std::fill_n(channel, skin.count, 0.0f);
}

void RelitSkin::add_gloss(const SkinPixels& skin, int y, const MixedNodes& mixed,
                          SkinLight& light) const {
  SkinDirections normals, toward_eye;
  const Vector3f row = ray_origin_ + (static_cast<float>(y) + 0.5f) * ray_down_;
  for (int k = 0; k < skin.count; ++k) {
    normals.x[k] = mixed.of[k][3];
    normals.y[k] = mixed.of[k][4];
    normals.z[k] = mixed.of[k][5];
    const float x = static_cast<float>(skin.column[k]) + 0.5f;
    toward_eye.x[k] = -(row.x() + x * ray_right_.x());
    toward_eye.y[k] = -(row.y() + x * ray_right_.y());
    toward_eye.z[k] = -(row.z() + x * ray_right_.z());
  }
  gloss_.shine(normals, toward_eye, skin.count, light);
  for (int k = 0; k < skin.count; ++k) {
    if (shines_[skin.face[k]]) continue;
    for (auto& channel : light.gloss) channel[k] = 0;
  }
}

}  // namespace organbake
