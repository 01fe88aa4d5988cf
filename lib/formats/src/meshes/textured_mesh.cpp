// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/textured_mesh.h"

#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr const char* kMaterial = "tissue";
constexpr double kMetresPerMillimetre = 0.001;
constexpr int kMetreDigits = 7;  // a ten-thousandth of a millimetre
constexpr int kUnitDigits = 6;

std::string line_of(const char* key, const Eigen::Vector3d& v, int digits) {
  return std::string(key) + " " + to_text(v.x(), digits) + " " + to_text(v.y(), digits) + " " +
         to_text(v.z(), digits) + "\n";
}

}  // namespace

Eigen::Vector3d scene_direction(const Eigen::Vector3d& world) {
  return {world.x(), world.z(), -world.y()};
}

Eigen::Vector3d scene_from_world(const Eigen::Vector3d& world_mm) {
  return kMetresPerMillimetre * scene_direction(world_mm);
}

std::string obj_text(const TexturedMesh& mesh, const std::string& material_file) {
  std::string text =
      "# metres, y up: x left, y superior, z anterior\n"
      "# LPS millimetres: 1000 x, -1000 z, 1000 y\nmtllib " +
      material_file + "\nusemtl " + kMaterial + "\n";
  for (const Eigen::Vector3d& v : mesh.vertices)
    text += line_of("v", scene_from_world(v), kMetreDigits);
  for (const Eigen::Vector2d& t : mesh.coordinates)
    text += "vt " + to_text(t.x(), kUnitDigits) + " " + to_text(t.y(), kUnitDigits) + "\n";
  for (const Eigen::Vector3d& n : mesh.normals)
    text += line_of("vn", scene_direction(n), kUnitDigits);
  for (const auto& face : mesh.faces) {
    text += "f";
    for (const TexturedMesh::Corner& corner : face) {
      const std::string vertex = std::to_string(corner.vertex + 1);
      text += " " + vertex + "/" + std::to_string(corner.coordinate + 1) + "/" + vertex;
    }
    text += "\n";
  }
  return text;
}

std::string obj_material_text(const TexturedMesh& mesh, const std::string& color_file,
                              const std::string& normal_file) {
  std::string text = std::string("newmtl ") + kMaterial +
                     "\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nPr " + to_text(mesh.roughness, 3) +
                     "\nPm 0\nmap_Kd " + color_file + "\n";
  if (!normal_file.empty()) text += "norm " + normal_file + "\n";
  return text;
}

}  // namespace organbake
