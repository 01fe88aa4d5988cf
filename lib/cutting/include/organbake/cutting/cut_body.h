// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "organbake/bundle/tetrahedral_body.h"
#include "organbake/cutting/cut_sheet.h"
#include "organbake/cutting/cut_tetrahedra.h"
#include "organbake/cutting/edge_crossings.h"

namespace organbake {

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

}  // namespace organbake
