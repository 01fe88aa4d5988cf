// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "organbake/image/channel_image.h"

namespace organbake {

// A mesh with textures, for those who draw with a GPU. A texture coordinate belongs to one vertex
// and one piece of the atlas; a vertex at a seam has several.
struct TexturedMesh {
  struct Corner {
    std::uint32_t vertex = 0, coordinate = 0;
  };
  std::vector<Eigen::Vector3d> vertices;     // mm, LPS
  std::vector<Eigen::Vector3d> normals;      // unit, of each vertex
  std::vector<Eigen::Vector2d> coordinates;  // 0…1, v upwards
  std::vector<Eigen::Vector3d> tangents;     // unit, of each coordinate: along u, across the normal
  std::vector<std::array<Corner, 3>> faces;
  Rgb8Image color;  // sRGB
  // Normals in the frame of tangent, normal × tangent and normal, −1…1 as 0…255; empty: none.
  Rgb8Image normal_map;
  double roughness = 1;  // of a GGX lobe, as glTF has it; 1 = matt
};

// What programs that draw take for space: metres, y up. x is the patient's left, y superior,
// z anterior. Both of the files below are in it.
Eigen::Vector3d scene_from_world(const Eigen::Vector3d& world_mm);
// The same turn for directions.
Eigen::Vector3d scene_direction(const Eigen::Vector3d& world);

// The texts of a Wavefront OBJ file and of its material library, which names the textures' files
// (normal_file empty: none).
std::string obj_text(const TexturedMesh& mesh, const std::string& material_file);
std::string obj_material_text(const TexturedMesh& mesh, const std::string& color_file,
                              const std::string& normal_file);

}  // namespace organbake
