// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/cutting/edge_crossings.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

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

}  // namespace organbake
