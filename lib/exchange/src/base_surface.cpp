// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/base_surface.h"

#include "organbake/core/error.h"
#include "organbake/geometry/lattice.h"

namespace organbake {

TriangleMesh base_surface(const Bundle& bundle) {
  const BaseLayer& base = bundle.base;
  const ShellSurface shell = bundle.shell();
  const TriangleMesh& at_rest = shell.at_rest();
  if (base.steps < 1 || base.face_count != at_rest.faces.size() ||
      base.height_mm.size() != std::size_t(base.face_count) * base.nodes_per_face() ||
      base.color.size() != base.height_mm.size()) {
    throw BadDataError("base layer: is not of this bundle's proxy");
  }
  const std::uint32_t n = base.steps;
  const Lattice lattice(at_rest, n);
  const std::vector<Lattice::ShellLine> lines = lattice.shell_lines();
  TriangleMesh mesh;
  mesh.vertices.resize(lattice.node_count());
  mesh.colors.resize(lattice.node_count());
  for (std::uint32_t face = 0; face < base.face_count; ++face) {
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return lattice.node(face, i, j); };
    each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      const std::size_t stored = std::size_t(face) * base.nodes_per_face() + node;
      const Lattice::ShellLine& line = lines[at(i, j)];
      mesh.vertices[at(i, j)] = line.foot + double(base.height_mm[stored]) * line.direction;
      mesh.colors[at(i, j)] = base.color[stored];
      if (i + j < n) mesh.faces.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + j + 1 < n) mesh.faces.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    });
  }
  return mesh;
}

}  // namespace organbake
