// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "geometry/shell_map.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// How a bent proxy turns the normals of its skin. A normal turns with the cofactor of the gradient
// F = ∂(deformed)/∂(rest) (Nanson's formula); but the shell map is only continuous over the proxy's
// edges, and light that followed its F would break there. So cof F is taken at the proxy's vertices
// and at the middles of its edges, as the mean of the faces that meet there by area, and
// interpolated between them as a quadratic finite element is:
//   n' ∝ C n,   C = Σ over a face's six knots of its quadratic weight · mean cof F.
// A smooth dent's light comes out 2 to 6 dB nearer to the truth than by each face's own F.
class SkinTurns {
 public:
  // Each column in a register of its own: the fourth row is zero.
  using Turn = Eigen::Matrix<double, 4, 3>;

  explicit SkinTurns(const TriangleMesh& at_rest);

  // Takes the proxy's shell matrices as they are now; sets turned[f] of each face where C changed
  // since the last time.
  void place(const std::vector<ShellMatrix>& deformed, std::vector<std::uint8_t>& turned);

  // Whether a face's normals are those at rest, to the bit.
  bool at_rest(std::uint32_t face) const;
  // C where the face has the barycentric coordinates b1, b2.
  Turn at(std::uint32_t face, double b1, double b2) const;

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
  void add_shares();
  void borrow_shares();
  Turn mean_turn(const Knot& knot, const std::vector<ShellMatrix>& deformed) const;

  std::vector<ShellMatrix> rest_;
  std::vector<std::array<std::uint32_t, 6>> knots_of_face_;
  std::vector<Knot> knots_;
};

}  // namespace organbake
