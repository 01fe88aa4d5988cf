// SPDX-License-Identifier: Apache-2.0
#include "core/file_ending.h"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace organbake {

std::string lower_ending(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), ::tolower);
  return ending;
}

bool is_picture_name(const std::filesystem::path& file) {
  const std::string ending = lower_ending(file);
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

bool is_frame_name(const std::filesystem::path& file) {
  return is_picture_name(file) || lower_ending(file) == ".exr";
}

bool is_mesh_name(const std::filesystem::path& file) {
  constexpr std::string_view kEndings[] = {".ply", ".obj", ".stl", ".off", ".vtk",
                                           ".vtp", ".vtu", ".glb", ".gltf"};
  return std::find(std::begin(kEndings), std::end(kEndings), lower_ending(file)) !=
         std::end(kEndings);
}

}  // namespace organbake
