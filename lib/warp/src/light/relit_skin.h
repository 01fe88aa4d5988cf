// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "light/gloss.h"
#include "light/normal_transport.h"
#include "light/scope_shine.h"
#include "light/skin_light.h"
#include "light/sparse_shading.h"
#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/lighting.h"
#include "organbake/geometry/shell_map.h"
#include "organbake/geometry/shell_surface.h"
#include "organbake/warp/view.h"
#include "placing/posed_shell.h"

namespace organbake {

// Skin that no lamp reached tells little of what it would show in full light.
inline constexpr float kLargestGain = 4, kLeastLight = 1e-3f;

struct LatticeTriangles;  // of some pixels

// How the light on the deformed skin differs from the light that its colours were taken in. A
// colour is intensity microstructure × the macro surface's shading at rest; so the shading of the
// deformed macro surface over that at rest, times the colour, is the skin lit anew:
//   gain(n', n) = diffuse(n') / diffuse(n) per channel, and gloss is added for the eye.
// The macro surface is the base layer's lattice; its smooth normals n turn with the proxy, smoothly
// over its edges (NormalTransport). No shadows: a fold's own shade stays as it was baked.
//
// By the light at the scope the gain is 1 / diffuse(n), which leaves the albedo, and ScopeShine
// lights that by the pixel.
class RelitSkin {
 public:
  // The layer is the shell's own, rest_normals by its nodes (lattice_normals.h).
  RelitSkin(const BaseLayer& layer, const ShellSurface& shell, const Lighting& lighting,
            const std::vector<Eigen::Vector3d>& rest_normals);

  const std::vector<Eigen::Vector3f>& rest_normals() const { return rest_normals_; }
  const Lighting& lighting() const { return lighting_; }
  const ScopeShine& shine() const { return shine_; }
  const NormalTransport& turns() const { return turns_; }

  // Takes the shell as it is now. Returns by face where that changes the light: 1.
  std::vector<std::uint8_t> turn(const PosedShell& shell);
  // Lights the faces for one view, shown[f] ≠ 0 those that it can see: of the others nothing is
  // asked. By the world's light, or by the one at the scope with its range of full exposure.
  void light_faces(const View& view, const PosedShell& shell,
                   const std::vector<std::uint8_t>& shown);
  void light_faces_from_scope(const View& view, double reference_mm,
                              const std::vector<std::uint8_t>& shown);
  bool from_scope() const { return from_scope_; }

  // Sends for what light asks for on a face.
  void prefetch(std::uint32_t face) const {
    const Node* const nodes = &nodes_[first_node(face)];
    for (std::size_t n = 0; n < lattice_.nodes_per_face(); ++n) __builtin_prefetch(nodes + n);
  }
  // Whether a face's colours stay as they are.
  bool unchanged(std::uint32_t face) const { return (turned_[face] | shines_[face]) == 0; }

  // Lights a span, its knots in `skin`; those that are not among them keep their light. From the
  // scope without the film: add_film() adds it to the whole vectors from pixel `first` on, with
  // `skin` each of their pixels.
  void light(const SkinPixels& skin, const SparseShading& span, const SpanColors& colors,
             ScopeSpan& from_scope) const;
  void add_film(const SkinPixels& skin, unsigned first, const SpanColors& colors,
                ScopeSpan& from_scope) const;

 private:
  // What light asks for at a node, in a line of the cache; the fourth numbers are unused.
  struct alignas(64) Node {
    Eigen::Vector4f gain{1, 1, 1, 0}, normal = Eigen::Vector4f::Zero();
    Eigen::Vector4f rest_normal = Eigen::Vector4f::Zero(), rest_mm = Eigen::Vector4f::Zero();
  };
  std::size_t first_node(std::uint32_t face) const {
    return std::size_t(face) * lattice_.nodes_per_face();
  }
  void place_face(std::uint32_t face, const ShellMatrix& shell);
  void light_face(std::uint32_t face);
  Eigen::Vector3f light_on(const Eigen::Vector3d& normal) const;
  bool may_shine(std::uint32_t face, const Eigen::Vector3f& eye) const;
  template <Eigen::Vector4f Node::*number>
  void mix(const LatticeTriangles& triangles, int count, ShadedPosts& mixed) const;
  void add_gloss(const SkinDirections& normals, const SpanColors& colors) const;
  void light_scope(const SkinPixels& skin, const LatticeTriangles& triangles,
                   const ShadingInterpolation& spread, const SpanColors& colors,
                   ScopeSpan& from_scope) const;
  void light_by(bool scope);
  void place_rest_nodes();

  BaseLayer lattice_;  // heights alone
  Lighting lighting_;
  Gloss gloss_;
  ScopeShine shine_;
  bool from_scope_ = false;
  NormalTransport turns_;
  std::vector<std::uint32_t> revisions_;              // of the shell's faces, as they were taken
  std::vector<Eigen::Vector3f> rest_normals_;         // by node, unit
  std::vector<Eigen::Vector3f> places_, rest_light_;  // by node: world mm, RGB
  std::vector<Node> nodes_;
  std::vector<std::uint8_t> turned_, shines_;      // by face: gain or gloss in this view
  std::vector<std::uint8_t> to_place_, to_light_;  // by face, when it is next seen
  // From the view's pixels to directions of the world: origin + x · right + y · down.
  Eigen::Vector3f ray_origin_, ray_right_, ray_down_;
};

}  // namespace organbake
