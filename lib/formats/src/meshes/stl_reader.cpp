// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <bit>
#include <cstring>

#include "meshes/mesh_readers.h"
#include "organbake/core/error.h"
#include "text/text_scanner.h"

namespace organbake {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is read as memory lies");

constexpr std::size_t kHeader = 84, kTriangle = 50, kNormal = 12;

bool is_word(std::string_view word, std::string_view lower_case) {
  return std::equal(word.begin(), word.end(), lower_case.begin(), lower_case.end(),
                    [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a + 32 : a) == b; });
}

void append(TriangleMesh& mesh, const Eigen::Vector3d& corner) {
  mesh.vertices.push_back(corner);
  if (mesh.vertices.size() % 3 != 0) return;
  const auto end = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.faces.push_back({end - 3, end - 2, end - 1});
}

// The triangles that a binary file says to hold.
std::uint64_t claimed(std::string_view bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + 80, 4);
  return count;
}

// Binary files may begin with "solid" as well: the text must have a facet, too.
bool is_text(std::string_view bytes, const std::string& name) {
  if (bytes.size() >= kHeader && bytes.size() == kHeader + kTriangle * claimed(bytes)) return false;
  TextScanner line(bytes.substr(0, 4096), name);
  if (!line.next_line('\0') || !is_word(line.words()[0], "solid")) return false;
  const bool more = line.next_line('\0');
  return more && (is_word(line.words()[0], "facet") || is_word(line.words()[0], "endsolid"));
}

TriangleMesh from_text(std::string_view bytes, const std::string& name) {
  TextScanner line(bytes, name);
  TriangleMesh mesh;
  std::size_t loop_begin = 0;
  bool ended = false;
  while (line.next_line('\0')) {
    const std::string_view word = line.words()[0];
    ended = is_word(word, "endsolid");
    if (is_word(word, "facet")) loop_begin = mesh.vertices.size();
    if (is_word(word, "vertex")) append(mesh, line.vector(1));
    if (is_word(word, "endloop") && mesh.vertices.size() != loop_begin + 3)
      line.fail("a facet has not three vertices");
  }
  if (!ended) line.fail("the text ends without \"endsolid\": truncated");
  return mesh;
}

TriangleMesh from_binary(std::string_view bytes, const std::string& name) {
  const std::uint64_t faces = claimed(bytes);
  if (bytes.size() < kHeader + kTriangle * faces || faces == 0) {
    throw BadDataError(name + ": claims " + std::to_string(faces) + " triangles but holds " +
                       std::to_string(bytes.size()) + " bytes: truncated or not an STL");
  }
  TriangleMesh mesh;
  for (std::uint64_t f = 0; f < faces; ++f) {
    float corners[9];
    std::memcpy(corners, bytes.data() + kHeader + kTriangle * f + kNormal, sizeof(corners));
    for (int c = 0; c < 3; ++c) append(mesh, Eigen::Vector3f(corners + 3 * c).cast<double>());
  }
  return mesh;
}

}  // namespace

TriangleMesh parse_stl(std::string_view bytes, const std::string& name) {
  return is_text(bytes, name) ? from_text(bytes, name) : from_binary(bytes, name);
}

}  // namespace organbake
