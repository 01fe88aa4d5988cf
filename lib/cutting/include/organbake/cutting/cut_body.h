// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tetrahedra that a sheet cuts, and the way from the world back to them at rest.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/cutting/cut_sheet.h"

namespace organbake {

// The edges of all tetrahedra.
std::vector<EdgeCrossings::Edge> edges_of(const std::vector<Tetrahedron>& tetrahedra);

// Tissue by the corner of a tetrahedron that it is at, whatever is cut there.
struct TetrahedronCorner {
  std::uint32_t tetrahedron = 0;
  int corner = 0;
};

// A body's tetrahedra when sheets have crossed their edges. A tetrahedron whose corners fall apart,
// joined by edges that are whole, is there once for each of these groups of corners: elements are
// copied whole and never cut up, so none is a sliver (the virtual nodes of Molino et al. 2004). The
// copies share their nodes with those beside them that hold the same tissue, and where a cut ends
// within a tetrahedron, both its sides.
class CutTetrahedra {
 public:
  struct Copy {
    std::uint32_t tetrahedron = 0;
    std::uint8_t corners = 0;  // bits: those whose tissue it holds
    std::array<std::uint32_t, 4> nodes{};
    double share = 1;  // of the tetrahedron's volume
  };

  CutTetrahedra(const TetrahedralBody& body, const EdgeCrossings& edges);

  // In the order of the tetrahedra.
  const std::vector<Copy>& copies() const { return copies_; }
  std::uint32_t first_copy(std::uint32_t tetrahedron) const { return first_[tetrahedron]; }
  std::uint32_t end_copy(std::uint32_t tetrahedron) const { return first_[tetrahedron + 1]; }
  // That holds the tissue at a corner.
  std::uint32_t copy_at(const TetrahedronCorner& at) const;
  // The first of those that a copy holds.
  TetrahedronCorner held_corner(std::uint32_t copy) const;
  bool split(std::uint32_t tetrahedron) const {
    return end_copy(tetrahedron) - first_copy(tetrahedron) > 1;
  }
  // Nodes: the body's own with their numbers, then copies.
  std::size_t node_count() const { return original_.size(); }
  std::uint32_t original(std::uint32_t node) const { return original_[node]; }
  // The pieces that the body has fallen into, numbered by their first copy.
  std::uint32_t fragment_count() const { return fragment_count_; }
  std::uint32_t fragment(std::uint32_t copy) const { return fragment_[copy]; }
  bool same_as(const CutTetrahedra& other) const;

 private:
  void make_copies(const TetrahedralBody& body, const EdgeCrossings& edges);
  void join_nodes(const TetrahedralBody& body);
  void drop_doubles();
  void number_fragments();

  std::vector<Copy> copies_;
  std::vector<std::uint32_t> first_, original_, fragment_;
  std::uint32_t fragment_count_ = 0;
};

// Tissue at a place: which copy of a tetrahedron holds it, and where in it: Σ weights · nodes.
struct TissuePlace {
  std::uint32_t copy = 0;
  std::array<double, 4> weights{};
};

// A body at rest as sheets have cut it, and which copies hold the tissue at its places. Beside
// sheets its tetrahedra are made finer: what a cut ends in holds together, and coarse tissue there
// would hardly open.
class CutBody {
 public:
  // What rounding may leave a weight below 0.
  static constexpr double kRoundedWeight = 1e-9;

  // Ranks of further points that are asked about: from first_free_rank() on.
  explicit CutBody(const TetrahedralBody& body);

  // Whole, as fine as it is now.
  const TetrahedralBody& uncut() const { return body_; }
  const MaterialGrid& grid() const { return grid_; }
  std::uint32_t first_free_rank() const { return first_nodes_ + 1; }
  const EdgeCrossings& edges() const { return edges_; }
  const CutTetrahedra& cut() const { return cut_; }
  double mean_edge_mm() const { return mean_edge_mm_; }

  // Takes a sheet's triangles from number `first_new` on, those before it were taken. Returns
  // whether the tetrahedra are others now, or hang together otherwise.
  bool add(std::span<const CutSheet::Triangle> triangles, std::size_t first_new);
  // Where the nodes of cut() lay in this body as it was before the last add().
  std::vector<NodeSource> sources(const CutBody& before) const;

  // Where the tissue at `side_mm` lies, told for a place near it: at a cut the two may differ, the
  // one on the cut, the other a little off it. Outside the body, that of the nearest tetrahedron.
  // Where cuts leave none of a tetrahedron's corners in sight, the copy that holds the tissue
  // `beside` it carries it, too.
  TissuePlace place(const Eigen::Vector3d& at_mm, const Eigen::Vector3d& side_mm,
                    const TissuePlace* beside = nullptr) const;
  // Weights of a place in a tetrahedron; outside it some are negative.
  std::array<double, 4> weights_in(std::uint32_t tetrahedron, const Eigen::Vector3d& at_mm) const;
  // Whether a copy holds the tissue at a place of its tetrahedron.
  bool holds(std::uint32_t copy, const Eigen::Vector3d& at_mm) const;

 private:
  std::uint32_t tetrahedron_at(const Eigen::Vector3d& at_mm) const;
  struct SeenCopy {
    std::uint32_t copy;
    bool in_sight;  // of one of its corners
  };
  SeenCopy copy_of(std::uint32_t tetrahedron, const Eigen::Vector3d& at_mm) const;
  bool refine(std::span<const CutSheet::Triangle> triangles, std::size_t first_new);
  void add_barriers(std::span<const CutSheet::Triangle> triangles);
  void measure();
  NodeSource place_of(std::uint32_t tetrahedron, std::uint32_t node,
                      const std::vector<Eigen::Vector3d>& nodes_mm, std::uint32_t copy) const;

  TetrahedralBody body_;
  std::uint32_t first_nodes_;           // before it was made finer
  std::vector<std::uint32_t> part_of_;  // by tetrahedron, of which before the last add()
  MaterialGrid grid_;
  EdgeCrossings edges_;
  CutTetrahedra cut_;
  double mean_edge_mm_ = 0;
  std::vector<Eigen::Matrix<double, 4, 3>> gradients_;
  std::vector<GridBox> boxes_;  // of the tetrahedra, a little wider
  struct Barrier {
    std::array<GridPoint, 3> corners;
    GridBox box;
  };
  std::vector<Barrier> barriers_;                          // the sheets' triangles
  std::vector<std::vector<std::uint32_t>> near_barriers_;  // by tetrahedron
  // Tetrahedra by the cells of a regular grid that their boxes touch, in increasing order.
  struct Cells {
    Eigen::Vector3d low_mm = Eigen::Vector3d::Zero();
    Eigen::Array3i count = Eigen::Array3i::Ones();
    double size_mm = 1;
    std::vector<std::vector<std::uint32_t>> tetrahedra;

    void sort_in(const TetrahedralBody& body, double least_mm);
    template <class Use>
    void each_near(const Eigen::Vector3d& at_mm, int reach, const Use& use) const;
  };
  Cells cells_, fine_cells_;  // as the body was baked, and as it is beside cuts
};

// The body in a deformed pose: from places of the world back to the tissue that lies there.
class PosedBody {
 public:
  // nodes_mm: of the cut body's nodes. Keeps both by reference.
  PosedBody(const CutBody& body, const std::vector<Eigen::Vector3d>& nodes_mm);

  struct Found {
    std::uint32_t copy;
    Eigen::Vector3d at_rest_mm;
  };
  const CutTetrahedra& cut() const { return body_.cut(); }
  // Copies whose tetrahedra may hold a place between the corners of a box.
  std::vector<std::uint32_t> near(const Eigen::Vector3d& low_mm,
                                  const Eigen::Vector3d& high_mm) const;
  // Of the copies given, in their order, the first that holds the tissue there.
  std::optional<Found> find(const Eigen::Vector3d& world_mm,
                            const std::vector<std::uint32_t>& copies) const;
  // At rest, as one copy carries it, be it far from it.
  Eigen::Vector3d at_rest(std::uint32_t copy, const Eigen::Vector3d& world_mm) const;

 private:
  std::array<double, 4> weights(std::uint32_t copy, const Eigen::Vector3d& world_mm) const;
  Eigen::Vector3d mixed(std::uint32_t copy, const std::array<double, 4>& weights) const;

  const CutBody& body_;
  const std::vector<Eigen::Vector3d>& nodes_mm_;
  std::vector<Eigen::Vector3d> low_, high_;  // boxes of the copies
};

}  // namespace organbake
