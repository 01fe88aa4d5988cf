// SPDX-License-Identifier: Apache-2.0
#pragma once

// The skin that a sheet cuts: made finer beside it, cut along its path, its lips drawn back and
// gaping.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "organbake/cutting/cut_sheet.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Whether places lie below a skin, which may be open: then what lies behind it along the axis in
// which it is shortest counts as below.
class SkinInside {
 public:
  // The skin's points take ranks from first_rank on, and two more those that are asked about.
  SkinInside(const TriangleMesh& skin, const MaterialGrid& grid, std::uint32_t first_rank);
  bool operator()(const Eigen::Vector3d& at_mm) const;

 private:
  MaterialGrid grid_;
  std::vector<std::array<GridPoint, 3>> faces_;
  std::vector<GridBox> boxes_;
  std::uint32_t rank_;
  Eigen::Vector3d far_mm_;
};

// A skin at rest whose faces are halved beside sheets, so that cuts end where they end and lips
// bend as the tissue under them does, and where the sheets cross its edges. The surface stays the
// same.
class FineSkin {
 public:
  // Its points take ranks from first_rank on.
  FineSkin(TriangleMesh skin, const MaterialGrid& grid, std::uint32_t first_rank);

  // Takes a sheet's triangles from number `first_new` on, those before it were taken. Returns
  // whether faces are others now, or cut that were not.
  bool add(std::span<const CutSheet::Triangle> triangles, std::size_t first_new);

  // The vertices of the skin as it was come first.
  const TriangleMesh& mesh() const { return mesh_; }
  const EdgeCrossings& edges() const { return edges_; }
  // Which part of which of the first faces a face is: its corners there, b1 and b2.
  struct Part {
    std::uint32_t face;
    std::array<Eigen::Vector2d, 3> at;
  };
  const std::vector<Part>& parts() const { return parts_; }

 private:
  bool refine(std::span<const CutSheet::Triangle> triangles, std::size_t first_new);

  TriangleMesh mesh_;
  MaterialGrid grid_;
  EdgeCrossings edges_;
  std::vector<Part> parts_;  // by face
};

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

class CutSkin;

// How far the lips of a cut stand apart that nothing pulls on: the skin of an organ is stretched
// at rest, and what was cut draws back. It is a matter of what is shown: the lips, the skin beside
// them and the walls below them are posed so before they are drawn, the tissue's own movement knows
// nothing of it, and a cut that is pulled open farther is shown as it is.
class LipGape {
 public:
  LipGape() = default;
  // A wall's vertex below a lip, by its share of the way down to the wall's deepest.
  struct Wall {
    std::uint32_t lip = 0;
    double down = 0;
  };
  // walls: of the vertices behind those of the skin. widest_mm: by half of it each lip draws back,
  // far from where the cut ends.
  LipGape(const CutSkin& skin, std::span<const Wall> walls, double widest_mm);

  // positions_mm: of CutOrgan::now()'s proxy, in any pose.
  void open(std::vector<Eigen::Vector3d>& positions_mm) const;
  struct Border {  // a piece of a lip, and the corner across from it of the skin's face there
    std::uint32_t from, to, inner;
  };
  const std::vector<Border>& borders() const { return borders_; }  // one lip's, then the other's

 private:
  struct Lip {
    std::uint32_t vertex, other;  // on the cut's other side
    double gape_mm;
  };
  struct Beside {  // goes with a lip
    std::uint32_t vertex;
    std::size_t lip;
    double share;
  };
  void find_lips(const CutSkin& skin, double widest_mm);
  void find_beside(const CutSkin& skin, double widest_mm);

  std::vector<Border> borders_;
  std::vector<Lip> lips_;
  std::vector<Beside> beside_;
};

// Moves the lips of cuts from which blades took tissue away apart, each by half the cut's width,
// and the skin beside them less and less. `vertices` are those of the skin.
void draw_skin_back(const CutSkin& skin, const CutSheet& sheet,
                    std::vector<CutSkin::Vertex>& vertices);

}  // namespace organbake
