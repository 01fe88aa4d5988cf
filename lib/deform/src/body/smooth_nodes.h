// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace organbake::deform
