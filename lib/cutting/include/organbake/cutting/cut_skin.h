// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "organbake/cutting/cut_sheet.h"
#include "organbake/cutting/edge_crossings.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

std::vector<EdgeCrossings::Edge> edges_of(const std::vector<Face>& faces);

// Of a face's corners: b1, b2.
inline const std::array<Eigen::Vector2d, 3> kCornersInFace = {
    Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)};
// From a place in a part of a face, whose corners lie in the face as told, to that in the face.
inline Eigen::Vector2d within(const std::array<Eigen::Vector2d, 3>& part,
                              const Eigen::Vector2d& at) {
  return (1 - at.sum()) * part[0] + at.x() * part[1] + at.y() * part[2];
}

// A part of a face of the skin, or all of it.
struct SkinPart {
  std::uint32_t face = 0;  // of the uncut skin
  Face corners{};          // vertices of the cut skin
  // Where they lie in the face: b1, b2.
  std::array<Eigen::Vector2d, 3> at = kCornersInFace;
};

// A piece of a cut's border, along a sheet: the vertices of its one side, with that side's tissue
// to the left, seen from outside, and of the other. At a cut's end a vertex is both sides'.
struct SkinBorder {
  std::uint32_t face = 0;  // of the uncut skin
  std::array<std::uint32_t, 2> left{}, right{};
};

// A skin at rest, cut along the lines in which sheets meet it. Faces are cut where at least two of
// their edges are, so that corners come apart, along the very line; where a cut ends within a face
// that face stays whole. From a blade that takes tissue away the lips are drawn back by half its
// width, and the skin beside them less and less.
class CutSkin {
 public:
  struct Vertex {
    Eigen::Vector3d at_mm;
    Eigen::Vector3d side_mm;  // beside the cut, where the tissue lies that carries it
    bool on_border = false;
    // On the border: the uncut skin's vertex whose side it is.
    std::uint32_t corner = 0;
    SheetPlace place;
    // From where the cut passed, by as much as a wide blade drew it back; at_mm counts it.
    Eigen::Vector3d drawn_back_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d on_cut_mm() const { return at_mm - drawn_back_mm; }
  };

  // edges: of the skin, where the sheet's triangles crossed them.
  CutSkin(const TriangleMesh& skin, const EdgeCrossings& edges, const CutSheet& sheet);

  // The uncut skin's first, with its numbers.
  const std::vector<Vertex>& vertices() const { return vertices_; }
  // The parts of face f: the first is number f, others follow behind those of all faces.
  const std::vector<SkinPart>& parts() const { return parts_; }
  const std::vector<SkinBorder>& borders() const { return borders_; }
  // Unit, of the skin beside a piece of border, before it was drawn back.
  Eigen::Vector3d normal_beside(const SkinBorder& border) const;

 private:
  struct EdgeEnds {  // the vertices of a cut edge's halves, by the end that they belong to
    std::uint32_t first, second;
  };
  class FaceCutter;
  void cut_edges(const TriangleMesh& skin, const EdgeCrossings& edges,
                 const std::vector<std::uint32_t>& crossed_faces);
  std::uint32_t add_vertex(const Vertex& vertex);

  std::vector<Vertex> vertices_;
  std::vector<SkinPart> parts_;
  std::vector<SkinBorder> borders_;
  std::map<std::uint32_t, EdgeEnds> ends_;  // of the edges that fall in two
};

}  // namespace organbake
