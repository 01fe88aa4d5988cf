// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>
#include <string>

#include "organbake/core/files.h"
#include "organbake/geometry/ply.h"

namespace organbake {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as memory lies");

template <typename T>
void append(std::string& bytes, const T* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

std::string header(const TriangleMesh& mesh) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\ncomment millimetres, LPS\nelement vertex " +
      std::to_string(mesh.vertices.size()) +
      "\nproperty double x\nproperty double y\nproperty double z\n";
  if (!mesh.colors.empty()) {
    text += "property float red\nproperty float green\nproperty float blue\n";
  }
  return text + "element face " + std::to_string(mesh.faces.size()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

}  // namespace

std::string serialise_ply(const TriangleMesh& mesh) {
  std::string bytes = header(mesh);
  bytes.reserve(bytes.size() + mesh.vertices.size() * 36 + mesh.faces.size() * 13);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    append(bytes, mesh.vertices[v].data(), 3);
    if (!mesh.colors.empty()) append(bytes, mesh.colors[v].data(), 3);
  }
  for (const Face& face : mesh.faces) {
    bytes += '\x03';
    append(bytes, face.data(), 3);
  }
  return bytes;
}

void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh) {
  write_file_atomically(path, serialise_ply(mesh));
}

}  // namespace organbake
