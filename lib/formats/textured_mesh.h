// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bundle/base_layer.h"
#include "geometry/triangle_mesh.h"
#include "image/channel_image.h"

namespace organbake {

// A mesh with a texture, for those who draw with a GPU. Texture coordinates in 0…1, v upwards; a
// corner has a vertex and a coordinate of its own.
struct TexturedMesh {
  struct Corner {
    std::uint32_t vertex = 0, coordinate = 0;
  };
  std::vector<Eigen::Vector3d> vertices;  // mm
  std::vector<Eigen::Vector2d> coordinates;
  std::vector<std::array<Corner, 3>> faces;
  Rgb8Image texture;  // sRGB
};

// The surface as the base layer has it: each proxy face cut into steps² triangles that stand at the
// layer's heights, and coloured by a texture with one texel a node. Faces that share an edge share
// its vertices. Throws BadDataError when the layer is not the proxy's.
TexturedMesh textured_base(const TriangleMesh& proxy, const BaseLayer& base);

// The texts of a Wavefront OBJ file and of its material library, which names the texture's file.
std::string obj_text(const TexturedMesh& mesh, const std::string& material_file);
std::string obj_material_text(const std::string& texture_file);

}  // namespace organbake
