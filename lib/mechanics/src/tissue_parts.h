// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Bars of tissue between vertices. Bars between the same two add up to one spring; springs come
// out in the order of their vertices.
class SpringBuilder {
 public:
  SpringBuilder(const TriangleMesh& proxy, double young_modulus_kpa);

  // A bar of constant cross-section: k = E·A/L. Between vertices that coincide there is no spring:
  // it would have no direction. Returns whether the two are apart.
  bool add_bar(std::uint32_t a, std::uint32_t b, double cross_section_mm2);

  std::vector<Spring> springs(const std::vector<double>& mass_kg, double damping_ratio) const;
  // The lowest vertex of the part that each vertex hangs together with.
  std::vector<std::uint32_t> parts() const;
  double least_length_mm() const { return least_length_mm_; }

 private:
  const TriangleMesh& proxy_;
  double modulus_n_per_mm2_;
  double least_length_mm_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> stiffness_n_per_mm_;
};

// Up to three struts from every part to its nearest vertices outside, until the network of the
// vertices with a share of the surface is one.
void tie_loose_parts(const TriangleMesh& proxy, const std::vector<double>& vertex_area_mm2,
                     SpringBuilder& network);
// Struts that keep the body's shape: from every vertex a column of its share of the surface
// (vertex_area_mm2) goes straight in and ends on the corners of the face opposite, by their
// barycentric weights. Where nothing lies opposite (an open or broken proxy), it ends at the
// vertex that lies best in that direction, if any does.
void add_body_struts(const TriangleMesh& proxy, const std::vector<double>& vertex_area_mm2,
                     SpringBuilder& network);

// The order in which the factor of the springs' matrix should eliminate the vertices that are no
// anchors (MechanicsModel::elimination_order), by nested dissection (METIS; Karypis & Kumar 1998).
// Empty for nets of less than some thousand vertices: minimum degree, which the player has itself,
// leaves about as sparse a factor there (CHOLMOD compares them: Chen et al. 2008).
std::vector<std::uint32_t> elimination_order(const MechanicsModel& model);

// A cube cut into five tetrahedra: one in the middle on every other corner, and one at each corner
// between. Neighbouring cells are cut as mirror images (`odd`), so that their faces match. Corners
// are numbered by bits: 1 for x, 2 for y, 4 for z.
struct LatticeCell {
  static constexpr int kTetrahedra = 5;

  bool odd = false;

  // Corners of tetrahedron 0 (the middle) … 4, of positive volume.
  std::array<int, 4> corners(int tetrahedron) const;
  struct Location {
    int tetrahedron = 0;
    std::array<double, 4> weights{};  // of its corners, 0…1 and of sum 1
  };
  // Where a point of the unit cube lies.
  Location locate(const Eigen::Vector3d& at) const;

 private:
  int middle_corner(int k) const;
};

// Cuts the proxy's inside out of a regular lattice of cubes of `cell_mm`, five tetrahedra each: of
// these all that hold some of the inside or a proxy vertex, with the share that is inside. 0 = a
// cell of three quarters of the proxy's mean edge (some hundreds of tetrahedra in 80 faces), but
// large enough that at most about a thousand fill the body. All nodes that hold an anchor, or skin
// between three of them, are anchors, so that the proxy's own stay where they are. skin: its
// vertices, and those of its faces, that are drawn: the first ones, or all. Throws
// BadDataError for a proxy that is not closed and UsageError for cells that would be more than a
// million.
TetrahedralBody make_lattice_body(const TriangleMesh& proxy,
                                  const std::vector<std::uint32_t>& anchors, double cell_mm,
                                  const TriangleMesh& skin);
inline TetrahedralBody make_lattice_body(const TriangleMesh& proxy,
                                         const std::vector<std::uint32_t>& anchors,
                                         double cell_mm) {
  return make_lattice_body(proxy, anchors, cell_mm, proxy);
}

// In how many parts, not joined by a node, the tetrahedra fall.
std::size_t part_count(const TetrahedralBody& body);

// A regular grid of points: count per axis, the first at `first_mm`, `spacing_mm` apart.
struct SampleGrid {
  Eigen::Vector3d first_mm = Eigen::Vector3d::Zero();
  double spacing_mm = 1;
  Eigen::Vector3i count = Eigen::Vector3i::Zero();

  std::size_t size() const { return std::size_t(count.x()) * count.y() * count.z(); }
  std::size_t index(int i, int j, int k) const {
    return (std::size_t(k) * count.y() + j) * count.x() + i;
  }
};

// Which of the grid's points lie inside the mesh (1) or not (0), x fastest: the winding number
// along lines in x, so that parts may overlap and edges need not be manifold. Throws BadDataError
// for a mesh that a line leaves more or less often than it enters: one that is not closed.
std::vector<std::uint8_t> inside_samples(const TriangleMesh& mesh, const SampleGrid& grid);

// Whether a surface is what one viewpoint has seen of tissue, and not the whole outside of a body:
// most of its faces look the same way.
bool is_sheet(const TriangleMesh& surface);

// The layer of tissue under a sheet, closed: the sheet, its vertices once more `thickness_mm`
// deeper, with their numbers after the sheet's, and sides along its borders. Deeper is against the
// mean of its normals by area, so that a sheet which hides nothing of itself from there does not
// fold.
TriangleMesh tissue_layer(const TriangleMesh& sheet, double thickness_mm);

// What TetrahedralBody::patches holds, by its nodes, tetrahedra, vertices and anchors. place: where
// a point of the skin lies in the tetrahedra, or nothing where none is; step_mm: how far apart it
// is asked at most.
std::vector<std::vector<NodeShare>> skin_patches(
    const TriangleMesh& skin, const TetrahedralBody& body, double step_mm,
    const std::function<std::optional<EmbeddedVertex>(const Eigen::Vector3d&)>& place);

// What TetrahedralBody::give_mm_per_n holds, by the model's tetrahedra and patches and the radius
// of its instrument: nothing of vertices that are held.
std::vector<double> skin_gives(const TriangleMesh& proxy, const MechanicsModel& model);

// Displacements (mm) of the proxy's vertices under dead loads (N), each column x, y, z by vertex:
// linear elasticity on the model's tetrahedra of constant strain, by sparse Cholesky, for small
// displacements. Throws BadDataError when nothing holds the body.
Eigen::MatrixXd fem_displacements(const MechanicsModel& model, const Eigen::MatrixXd& loads_n);

}  // namespace organbake
