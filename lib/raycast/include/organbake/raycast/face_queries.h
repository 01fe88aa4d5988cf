// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A triangle's corners by value: what the double-precision side of ray casting works on.
struct FaceCorners {
  Eigen::Vector3d a, b, c;
};

// Where a line meets a face's plane: origin + t·direction = a + u(b − a) + v(c − a). Not finite
// when the line runs in the plane or the face has no area.
struct PlaneCrossing {
  double t = 0, u = 0, v = 0;
  // All three corner weights above `margin`; false when anything is NaN.
  bool inside_by(double margin) const { return u > margin && v > margin && 1 - u - v > margin; }
};

// Cramer's rule on t·d − u·e1 − v·e2 = a − o (Möller & Trumbore 1997). Inline: it runs per ray.
inline PlaneCrossing cross_plane(const FaceCorners& face, const Eigen::Vector3d& origin,
                                 const Eigen::Vector3d& direction) {
  const Eigen::Vector3d e1 = face.b - face.a, e2 = face.c - face.a, to_face = face.a - origin;
  const Eigen::Vector3d normal = e1.cross(e2), r = to_face.cross(direction);
  const double inverse = 1 / direction.dot(normal);
  return {to_face.dot(normal) * inverse, e2.dot(r) * inverse, -e1.dot(r) * inverse};
}

// The face with its edges moved outward by `margin`, at most half as large again; a face without
// area stays as it is.
FaceCorners enlarged(const FaceCorners& face, double margin);

// The point of the face that lies nearest (Ericson 2005, 5.1.5); faces without area are treated
// as their longest edge, or as a point.
Eigen::Vector3d closest_on_face(const FaceCorners& face, const Eigen::Vector3d& point);

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
