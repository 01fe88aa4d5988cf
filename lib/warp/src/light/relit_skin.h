// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "light/scope_shine.h"
#include "organbake/bundle/base_layer.h"
#include "organbake/cutting/cut_organ.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/warp/draw_options.h"
#include "placing/placing.h"

namespace organbake {

// Lighting::glossy() for every pixel: in single precision, the sum of the lobes from a table, and
// nothing where it would not show.
class Gloss {
 public:
  explicit Gloss(const Lighting& lighting);

  bool none() const { return lamps_.empty(); }

  // Of `count` pixels whose vectors may have any length; RGB. Nothing for a normal that is 0.
  void shine(const SkinPlanes& normals, const SkinPlanes& toward_eye, int count,
             SkinPlanes& gloss) const;

  // Whether it shows on a unit normal, or on one that leans from it by up to kLean.
  bool may_show(const Eigen::Vector3f& normal, const Eigen::Vector3f& toward_eye) const;

 private:
  static constexpr int kSteps = 1024;
  static constexpr float kLean = 0.2f;  // rad: more than the nodes of a lattice triangle differ
  struct Lamp {
    Eigen::Vector3f toward, color;
  };
  std::vector<Lamp> lamps_;
  float least_cosine_ = 1, inverse_range_ = 1;  // the range: 1 − least
  float least_near_cosine_ = 1;                 // of half-ways that a normal within kLean shows
  // Σ strength · cosine^exponent. Even in about the angle, where lobes are narrow.
  std::array<float, kSteps + 1> table_{};
};

// How a bent shell turns the normals of its skin. A normal turns with the cofactor of the gradient
// F = ∂(deformed)/∂(rest) (Nanson's formula); but the shell map is only continuous over the proxy's
// edges, and light that followed its F would break there. So cof F is taken at the proxy's vertices
// and at the middles of its edges, as the mean of the faces that meet there by area, and
// interpolated between them as a quadratic finite element is:
//   n' ∝ C n,   C = Σ over a face's six knots of its quadratic weight · mean cof F.
// A smooth dent's light comes out 2 to 6 dB nearer to the truth than by each face's own F. The many
// faces of a smooth skin bend so little that the means at their vertices, interpolated linearly,
// are enough: its knots are the vertices alone.
class NormalTransport {
 public:
  // Each column in a register of its own. The fourth row begins with how much more sharply the skin
  // bends there than at rest, rad a mm; the rest of it is zero.
  using Turn = Eigen::Matrix<float, 4, 3>;

  explicit NormalTransport(const ShellSurface& shell);

  // The shell's matrices at rest, by face.
  const std::vector<ShellMatrix>& rest() const { return rest_; }

  // Takes the shell's matrices as they are now, changed[f] of each that is not as it was the last
  // time (the first time: at rest); sets turned[f] of each face where C changed since then.
  void place(const std::vector<ShellMatrix>& deformed, const std::vector<std::uint8_t>& changed,
             std::vector<std::uint8_t>& turned);

  // Whether a face's normals are those at rest, to the bit.
  bool at_rest(std::uint32_t face) const;
  // A face's knots in use, the knots of all faces, and C at the knots.
  int knots_in_use() const { return places_; }
  const std::vector<std::array<std::uint32_t, 6>>& knots_of_faces() const { return knots_of_face_; }
  std::vector<Turn> turns() const;
  // C at a face's knots, gathered once for all of its nodes, and where it has the barycentric
  // coordinates b1, b2.
  using OnFace = std::array<Turn, 6>;
  OnFace on(std::uint32_t face) const;
  Turn at(const OnFace& on, float b1, float b2) const;

 private:
  // A face's view of a knot: 0…2 are its corners, 3…5 the middles of the edges opposite to them.
  struct Share {
    std::uint32_t face;
    int place;
    // Its area's share × (cof R)⁻¹, with R the tangents and the normal at rest: Rᵀ / Σ det R.
    Eigen::Matrix3d of_rest;
  };
  // A vertex or an edge.
  struct Knot {
    std::vector<Share> shares;
    double bend_at_rest = 0;       // rad a mm
    Turn turn = Turn::Identity();  // mean cof F, and below it how much more it bends
  };
  std::span<const std::uint32_t> knots_of(std::size_t face) const {
    return std::span(knots_of_face_[face]).first(static_cast<std::size_t>(places_));
  }
  void add_shares();
  void borrow_shares();
  Turn mean_turn(const Knot& knot, const std::vector<ShellMatrix>& deformed) const;

  int places_;  // a face's knots: all six, or the corners
  std::vector<ShellMatrix> rest_;
  std::vector<std::array<std::uint32_t, 6>> knots_of_face_;
  std::vector<Knot> knots_;
};

// Smooth unit normals of the macro surface at rest, by the layer's nodes: those of the lattice's
// small triangles, by area. Nodes that faces share along the proxy's edges have one normal; slivers
// between them take those of their rim.
std::vector<Eigen::Vector3d> lattice_normals(const BaseLayer& layer, const TriangleMesh& proxy);

// Of an organ that blades have cut, by the same nodes: of its skin those that the same material had
// when it was whole, `uncut`; of its walls CutOrgan::wall_normals(). Lips lie flat (CutOrgan) and
// the faces beside them may be narrow, but what lit the skin when its colours were taken is how it
// lay then.
std::vector<Eigen::Vector3d> cut_normals(const std::vector<Eigen::Vector3f>& uncut,
                                         const CutOrgan::FaceParts& parts, const TriangleMesh& cut,
                                         std::uint32_t steps);

// The range of full exposure of the light at the scope, mm: options.scope_reference_mm where that
// is set or the light is another, ScopeLight::reference_mm where that is. Else as a camera's
// automatic exposure finds it: the skin's mean brightness over the picture, its middle counting
// most, comes to the same each time. By the organs' proxies at rest: a poke changes no exposure,
// and frames depend on nothing before them.
double metered_mm(const ScopeLight& scope, std::span<const TriangleMesh* const> proxies_at_rest,
                  const View& view, const DrawOptions& options);

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
// lights that, its film by the pixel.
class RelitSkin {
 public:
  // The layer is the shell's own, rest_normals by its nodes (lattice_normals()).
  RelitSkin(const BaseLayer& layer, const ShellSurface& shell, const Lighting& lighting,
            const std::vector<Eigen::Vector3d>& rest_normals);

  const std::vector<Eigen::Vector3f>& rest_normals() const { return rest_normals_; }
  // By node, how sharply its normals turn at rest, rad a mm; empty where no relief is asked for.
  const std::vector<float>& bends() const { return bends_; }
  const Lighting& lighting() const { return lighting_; }
  const ScopeShine& shine() const { return shine_; }
  const NormalTransport& turns() const { return turns_; }

  // Takes the shell as it is now. Returns by face where that changes the light: 1.
  std::vector<std::uint8_t> turn(const PosedShell& shell);
  // Lights the faces for one view, shown[f] ≠ 0 those that it can see: of the others nothing is
  // asked. By the world's light, or by the one at the scope with its range of full exposure.
  void light_faces(const View& view, DrawnLight light, double reference_mm, const PosedShell& shell,
                   const std::vector<std::uint8_t>& shown);
  bool from_scope() const { return from_scope_; }

  // Sends for what light asks for on a face.
  void prefetch(std::uint32_t face) const {
    const Node* const nodes = &nodes_[first_node(face)];
    for (std::size_t n = 0; n < lattice_.nodes_per_face(); ++n) __builtin_prefetch(nodes + n);
  }
  // Whether a face's colours stay as they are.
  bool unchanged(std::uint32_t face) const { return (turned_[face] | shines_[face]) == 0; }

  // Lights a span's rows by their knots' skin, from the scope without the film: that add_film()
  // adds, of skin of the very pixels whose numbers are put into film_at. Returns how many they are;
  // or kAskAnew, having lit nothing, where the span has other knots now (SparseShading::refine).
  static constexpr int kAskAnew = -1;
  int light(const SkinPixels& knots, SparseShading& span, std::span<const SpanColors> rows,
            std::int32_t* film_at) const;
  void add_film(const SkinPixels& skin, std::span<const SpanColors> rows) const;

 private:
  // What light asks for at a node, in a line of the cache; of the fourth numbers that of the normal
  // at rest is the bend, that of the normal what comes to it now, the others are unused.
  struct alignas(64) Node {
    Eigen::Vector4f gain{1, 1, 1, 0}, normal = Eigen::Vector4f::Zero();
    Eigen::Vector4f rest_normal = Eigen::Vector4f::Zero(), rest_mm = Eigen::Vector4f::Zero();
  };
  std::size_t first_node(std::uint32_t face) const {
    return std::size_t(face) * lattice_.nodes_per_face();
  }
  void light_face(std::uint32_t face);
  Eigen::Vector3f light_on(const Eigen::Vector3d& normal) const;
  bool may_shine(std::uint32_t face, const Eigen::Vector3f& eye) const;
  template <Eigen::Vector4f Node::*... numbers>
  void mix(const LatticeTriangles& triangles, int count,
           const std::array<SkinPlanes*, sizeof...(numbers)>& planes) const;
  void add_gloss(int g, const SkinPlanes& normals, std::span<const SpanColors> rows) const;
  int light_scope(const SkinPixels& pixels, const LatticeTriangles& triangles, SparseShading& span,
                  std::span<const SpanColors> rows, std::int32_t* film_at) const;
  void place_rest_nodes();

  BaseLayer lattice_;  // heights alone
  Lighting lighting_;
  Gloss gloss_;
  ScopeShine shine_;
  bool from_scope_ = false;
  NormalTransport turns_;
  std::vector<std::uint32_t> revisions_;       // of the shell's faces, as they were taken
  std::vector<Eigen::Vector3f> rest_normals_;  // by node, unit
  std::vector<float> bends_;
  std::vector<Eigen::Vector3f> places_, rest_light_;  // by node: world mm, RGB
  std::vector<Node> nodes_;
  std::vector<std::uint8_t> turned_, shines_;      // by face: gain or gloss in this view
  std::vector<std::uint8_t> to_place_, to_light_;  // by face, when it is next seen
};

}  // namespace organbake
