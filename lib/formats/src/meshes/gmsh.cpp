// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/gmsh.h"

#include "meshes/asset_text.h"
#include "meshes/tetrahedra_of.h"

namespace organbake {

std::string gmsh_text(const Bundle& bundle) {
  const TetrahedralBody& body = tetrahedra_of(bundle, "a mesh of gmsh");
  std::string text =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"tissue\"\n"
      "$EndPhysicalNames\n$Nodes\n" +
      std::to_string(body.nodes_mm.size()) + "\n";
  for (std::size_t n = 0; n < body.nodes_mm.size(); ++n)
    text += std::to_string(n + 1) + " " + metres_text(body.nodes_mm[n], " ") + "\n";
  text += "$EndNodes\n$Elements\n" + std::to_string(body.tetrahedra.size()) + "\n";
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) {
    constexpr const char* kOneTetrahedron = " 4 2 1 1";  // of 4 nodes; physical and own volume 1
    text += std::to_string(t + 1) + kOneTetrahedron;
    for (const std::uint32_t node : body.tetrahedra[t].nodes)
      text += " " + std::to_string(node + 1);
    text += "\n";
  }
  return text + "$EndElements\n";
}

}  // namespace organbake
