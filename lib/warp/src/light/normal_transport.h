// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/geometry/shell_map.h"
#include "organbake/geometry/shell_surface.h"

namespace organbake {

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
  // Each column in a register of its own: the fourth row is zero.
  using Turn = Eigen::Matrix<double, 4, 3>;
  using FloatTurn = Eigen::Matrix<float, 4, 3>;

  explicit NormalTransport(const ShellSurface& shell);

  // The shell's matrices at rest, by face.
  const std::vector<ShellMatrix>& rest() const { return rest_; }

  // Takes the shell's matrices as they are now, changed[f] of each that is not as it was the last
  // time (the first time: at rest); sets turned[f] of each face where C changed since then.
  void place(const std::vector<ShellMatrix>& deformed, const std::vector<std::uint8_t>& changed,
             std::vector<std::uint8_t>& turned);

  // Whether a face's normals are those at rest, to the bit.
  bool at_rest(std::uint32_t face) const;
  // A face's knots in use, the knots of all faces, and C at a knot.
  int knots_in_use() const { return places_; }
  const std::vector<std::array<std::uint32_t, 6>>& knots_of_faces() const { return knots_of_face_; }
  std::size_t knot_count() const { return knots_.size(); }
  auto turn_at(std::size_t knot) const { return knots_[knot].turn.topRows<3>(); }
  // C over a face, gathered once for all of its nodes.
  class OnFace {
   public:
    // Where it has the barycentric coordinates b1, b2.
    FloatTurn at(float b1, float b2) const;

   private:
    friend class NormalTransport;
    int places_ = 0;
    std::array<FloatTurn, 6> turns_;
  };
  OnFace on(std::uint32_t face) const;

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
    Turn turn = Turn::Identity();  // mean cof F
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

}  // namespace organbake
