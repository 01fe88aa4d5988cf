// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "body/tissue.h"
#include "contact/padded_vector.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake::deform {

// The nodes of smooth skins (geometry/smooth_skin.h) as they lie now. A tip sees a handful of them:
// they are carried, and their normals made, when first asked for in a pose.
class SmoothNodes {
 public:
  // The nodes of one organ's skin, the vertices of its proxy in the given slots.
  void add(const DeformBody& body, const std::uint32_t* slot_of_vertex);
  std::size_t count() const { return first_.size() - 1; }
  std::span<const Carrier> carriers(std::uint32_t node) const {
    return std::span(carriers_).subspan(first_[node], first_[node + 1] - first_[node]);
  }

  // Takes x (mm, by slot; kept by reference until the next pose) as the current shape.
  void pose(const PaddedVectors& x);
  const PaddedVector& point(std::uint32_t node);   // mm
  const PaddedVector& normal(std::uint32_t node);  // unit, outward

 private:
  std::vector<std::uint32_t> first_ = {0};  // of each node's carriers, and the end
  std::vector<Carrier> carriers_;
  std::vector<Face> faces_;  // of nodes
  VertexFaces faces_of_;
  const PaddedVectors* x_ = nullptr;
  PaddedVectors points_, normals_;
  std::vector<std::uint32_t> posed_points_, posed_normals_;  // in which pose
  std::uint32_t pose_ = 0;
};

// A material point of the skin: bound to the shell over a proxy face (geometry/shell.h).
struct SkinPoint {
  std::uint32_t face = 0;
  double b1 = 0, b2 = 0;
  double height_mm = 0;
};

// The shell over one face as it lies now: the rows of the face's shell matrix.
struct SkinFace {
  Double4 origin, along1, along2;    // of the proxy's face
  Double4 normal, normal1, normal2;  // of its vertex normals

  Double4 normal_at(double b1, double b2) const { return normal + b1 * normal1 + b2 * normal2; }
  Double4 at(double b1, double b2, double height_mm) const {
    return origin + b1 * along1 + b2 * along2 + height_mm * normal_at(b1, b2);
  }
};

struct SkinHit {
  SkinPoint at;
  PaddedVector point = PaddedVector::Zero();   // mm
  PaddedVector normal = PaddedVector::Zero();  // outward, unit: the shell's direction at the point
  double distance_mm = 0;
};

// The true skin over the proxy, where instruments meet it. Every face of the proxy has a lattice of
// nodes: of a smooth skin, which its own weights carry; without one of the base layer, by heights
// that the shell map carries. With neither it is the proxy itself.
//
// A smooth skin's nodes have heights as well, as they are at rest: the prisms over the faces hold
// the skin where it is bent little, and serve to look for what may touch.
class Skin {
 public:
  // tissue must outlive the skin; bodies: those that it was made from.
  Skin(const Tissue& tissue, const DeformBodies& bodies);

  const std::vector<Face>& faces() const { return tissue_->faces(); }
  double tallest_mm(std::uint32_t face) const { return tallest_mm_[face]; }
  double lowest_mm(std::uint32_t face) const { return lowest_mm_[face]; }
  double highest_mm(std::uint32_t face) const { return highest_mm_[face]; }
  // The corners of the prism that holds a face's skin: convex, and it bounds it.
  std::array<PaddedVector, 6> skin_prism(std::uint32_t face);
  double tallest_mm() const { return tallest_of_all_mm_; }

  // Takes x (mm, by slot; kept by reference until the next pose) as the current shape. Vertex
  // normals are made on demand, once per pose: a contact sees a handful of them.
  void pose(const PaddedVectors& x);
  // All of them at once, for one who needs all: the same up to rounding.
  void pose_all_normals();
  const PaddedVectors& shape() const { return *x_; }
  // Whether a smooth skin lies over any face.
  bool smooth() const { return nodes_.count() > 0; }
  bool smooth(std::uint32_t face) const { return lattices_[face].first_node != kFlat; }
  // Pieces that the lattice over a face cuts each of its edges in.
  std::uint32_t steps(std::uint32_t face) const { return lattices_[face].steps; }
  // Whether a face is a cut's wall, or ends at its lips.
  bool at_cut(std::uint32_t face) const { return at_cut_[face] != 0; }
  // The slots that carry a smooth face's nodes, and its leverage: no node moves farther than the
  // farthest of them times that.
  std::span<const std::uint32_t> carriers(std::uint32_t face) const {
    return std::span(carriers_).subspan(carrier_start_[face],
                                        carrier_start_[face + 1] - carrier_start_[face]);
  }
  double leverage(std::uint32_t face) const { return leverage_[face]; }
  // All that carry one point: of a face that is not smooth its vertices, its shell's turning apart.
  std::vector<Carrier> carriers(const SkinPoint& at) const;
  // The box about a smooth face's nodes as they lie now.
  struct Box {
    PaddedVector low, high;
  };
  Box node_box(std::uint32_t face);
  SkinFace frame(std::uint32_t face);
  SkinHit hit(const SkinPoint& at, const PaddedVector& center);
  // The skin over a place of a face, between the lattice's nodes.
  SkinPoint point_over(std::uint32_t face, double b1, double b2) const;
  // The nearest skin point of one face: the nearest lattice node's neighbourhood.
  SkinHit nearest(std::uint32_t face, const PaddedVector& center);
  // The same of the whole skin.
  SkinHit nearest(const PaddedVector& center);
  // Whether a point lies inside of what the proxies' faces, or some of them, close or nearly close:
  // they wind about it once.
  bool encloses(const PaddedVector& point, std::span<const std::uint32_t> of_faces) const;
  bool encloses(const PaddedVector& point) const;
  // How near the face may come: the distance to the proxy's face or, of a smooth one, to its box.
  double least_distance(std::uint32_t face, const PaddedVector& center);
  // All lattice nodes of a face within `radius_mm` of `center`, in lattice order.
  void nodes_within(std::uint32_t face, const PaddedVector& center, double radius_mm,
                    std::vector<SkinHit>& hits);

 private:
  const PaddedVector& vertex_normal(std::uint32_t slot);
  void set_normal(std::uint32_t slot, const Double4& sum);
  // The lattice over one face.
  struct FaceLattice {
    std::uint32_t steps = 1;
    std::size_t first = kFlat;       // of its heights
    std::size_t first_node = kFlat;  // of a smooth skin's nodes, in the heights' order
  };
  static constexpr std::size_t kFlat = ~std::size_t{0};
  // A place of a face in its lattice: three nodes and their weights.
  struct Cell {
    std::array<std::array<std::uint32_t, 2>, 3> corners;
    std::array<double, 3> weights;
  };
  Cell cell_at(std::uint32_t face, double b1, double b2) const;
  std::size_t lattice_index(std::uint32_t face, std::uint32_t i, std::uint32_t j) const {
    return i * (steps(face) + 1) - i * (i - 1) / 2 + j;
  }
  std::uint32_t node(std::uint32_t face, std::uint32_t i, std::uint32_t j) const {
    return node_of_[lattices_[face].first_node + lattice_index(face, i, j)];
  }
  double height(std::uint32_t face, std::uint32_t i, std::uint32_t j) const {
    const FaceLattice& l = lattices_[face];
    return l.first == kFlat ? 0 : heights_[l.first + lattice_index(face, i, j)];
  }
  void add_lattices(const DeformBody& body);
  void add_smooth_lattices(const DeformBody& body, const std::uint32_t* slot_of_vertex);
  void add_lattice(std::uint32_t steps, const float* heights_mm);
  void find_carriers();
  Double4 node_point(const SkinFace& frame, std::uint32_t face, std::uint32_t i, std::uint32_t j);
  SkinPoint nearest_in_cell(const SkinFace& frame, std::uint32_t face, const Double4& center,
                            const std::uint32_t (&corners)[3][2], double& squared);

  const Tissue* tissue_;
  std::vector<FaceLattice> lattices_;  // one per face
  std::vector<float> heights_;
  std::vector<std::uint32_t> node_of_;  // of the smooth skins, by lattice
  SmoothNodes nodes_;
  std::vector<std::uint32_t> carrier_start_ = {0}, carriers_;  // by face
  std::vector<double> leverage_;                               // by face
  std::vector<std::uint8_t> at_cut_;                           // by face
  std::vector<double> tallest_mm_;
  std::vector<double> lowest_mm_, highest_mm_;  // of each face's heights
  double tallest_of_all_mm_ = 0;
  VertexFaces faces_of_slot_;
  const PaddedVectors* x_ = nullptr;
  PaddedVectors normals_;
  std::vector<std::uint32_t> posed_;
  std::uint32_t pose_ = 0;
};

}  // namespace organbake::deform
