// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "organbake/geometry/adjacency.h"
#include "organbake/geometry/shell_map.h"
#include "organbake/geometry/shell_surface.h"
#include "organbake/geometry/vertex_gradients.h"

namespace organbake {

// A bundle's shell as the proxy carries it now, and what drawing it asks of every face. Kept from
// one pose to the next: a poke moves few faces, and only they are worked out anew.
class PosedShell {
 public:
  explicit PosedShell(ShellSurface shell);

  // Takes the proxy's vertices (mm), of which there must be as many as at rest.
  void pose(const std::vector<Eigen::Vector3d>& proxy_positions);

  const ShellSurface& shell() const { return shell_; }
  const TriangleMesh& at_rest() const { return shell_.at_rest(); }
  const std::vector<Eigen::Vector3d>& proxy_positions() const { return proxy_positions_; }
  const std::vector<ShellMatrix>& matrices() const { return matrices_; }  // by face, world
  // By face, another number whenever it may lie otherwise than before.
  const std::vector<std::uint32_t>& revisions() const { return revisions_; }
  // Whether a face is pushed, and bent out of its neighbours' skin: a deep poke folds slivers of a
  // coarse proxy over. Both its sides are skin then, or the fold would be a hole.
  bool two_sided(std::size_t face) const { return two_sided_[face] != 0; }
  const std::vector<std::uint8_t>& two_sided() const { return two_sided_; }  // by face

 private:
  bool bent_over(std::uint32_t face) const;
  void set_vertex(std::uint32_t vertex);
  void set_normal(std::uint32_t vertex);
  void set_face(std::uint32_t face);

  ShellSurface shell_;
  double pushed_mm_;
  std::vector<Eigen::Vector3d> proxy_positions_, next_vertices_;
  TriangleMesh posed_;
  std::vector<Eigen::Vector3d> normals_;           // by vertex
  std::optional<VertexGradients> gradients_;       // of a smooth skin
  std::vector<Eigen::Matrix3d> gradient_changes_;  // by vertex
  std::vector<ShellMatrix> matrices_;
  std::vector<std::uint32_t> revisions_;
  std::vector<std::uint8_t> two_sided_;
  VertexFaces faces_of_;
  std::vector<std::uint8_t> vertex_changed_, face_changed_;  // of scratch
};

}  // namespace organbake
