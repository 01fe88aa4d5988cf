// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Faces that hang together across edges of two faces.
struct MeshPiece {
  std::vector<std::uint32_t> faces;
  bool closed = true;     // every edge has two faces
  double volume_mm3 = 0;  // signed; of an open piece as seen from the middle of its faces
  double area_mm2 = 0;
  // Length of the faces' area vectors' sum, as a share of the area: 0 of what is closed, 1 of a
  // plane.
  double open_share = 0;
};

// By their first faces; each piece's in the order in which they are reached.
std::vector<MeshPiece> pieces_of(const TriangleMesh& mesh);

// Swaps two corners of each.
void turn_faces(TriangleMesh& mesh, const std::vector<std::uint32_t>& faces);

// Turns faces so that neighbours across edges of two faces are wound alike, each piece as most of
// its area was wound. Returns how many faces were turned. A piece that cannot be wound alike (a
// Möbius strip) keeps a seam.
std::size_t wind_alike(TriangleMesh& mesh);

struct TurnedFaces {
  std::size_t faces = 0;                // that were wound against their neighbours
  std::size_t outward = 0, inward = 0;  // pieces

  // "2 closed pieces that were wound inside out turned outward"
  std::vector<std::string> sentences() const;
};

// wind_alike(), and then turns whole pieces so that solids look outward and the walls of cavities
// inward: a closed piece is a wall when it lies within an odd number of larger ones, which rays
// from points all over it tell; one that crosses another is a solid. Of pieces that are all but
// closed the volume tells the outside; other open ones are left: their winding says which side is
// seen. The same for any number of threads.
TurnedFaces turn_outward(TriangleMesh& mesh);
// The same where half_edge_twins() of the mesh are known.
TurnedFaces turn_outward(TriangleMesh& mesh, std::vector<std::uint32_t> twins);

}  // namespace organbake
