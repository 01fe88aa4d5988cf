// SPDX-License-Identifier: GPL-3.0-or-later
#include <charconv>

#include "meshes/mesh_readers.h"
#include "organbake/geometry/polygon.h"
#include "organbake/geometry/written_color.h"
#include "text/text_scanner.h"

namespace organbake {
namespace {

std::string joined_lines(std::string_view text) {
  std::string joined(text);
  for (std::size_t at = joined.find('\\'); at != std::string::npos;
       at = joined.find('\\', at + 1)) {
    std::size_t end = at + 1;
    if (end < joined.size() && joined[end] == '\r') ++end;
    if (end >= joined.size() || joined[end] != '\n') continue;
    for (std::size_t i = at; i <= end; ++i) joined[i] = ' ';
  }
  return joined;
}

// The first index of 7, 7/1, 7//2 or 7/1/2, from 0; negative ones count back from the last vertex.
std::uint32_t vertex_of(const TextScanner& line, std::size_t word, std::size_t vertex_count) {
  const std::string_view text = line.words()[word].substr(0, line.words()[word].find('/'));
  long long index = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), index);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size() || index == 0)
    line.fail("\"" + std::string(line.words()[word].substr(0, 40)) + "\" names no vertex");
  const long long at = index > 0 ? index - 1 : static_cast<long long>(vertex_count) + index;
  if (at < 0 || at > 0xFFFFFFFELL) line.fail("vertex " + std::to_string(index) + " does not exist");
  return static_cast<std::uint32_t>(at);
}

}  // namespace

TriangleMesh parse_obj(std::string_view text, const std::string& name) {
  const std::string joined = joined_lines(text);
  TextScanner line(joined, name);
  TriangleMesh mesh;
  std::vector<Eigen::Vector3d> colors;
  std::vector<std::uint32_t> corners;
  std::vector<std::size_t> ends;
  while (line.next_line()) {
    const auto& words = line.words();
    if (words[0] == "v") {
      mesh.vertices.push_back(line.vector(1));
      if (words.size() >= 7) colors.push_back(line.vector(4));
    } else if (words[0] == "f") {
      for (std::size_t w = 1; w < words.size(); ++w)
        corners.push_back(vertex_of(line, w, mesh.vertices.size()));
      ends.push_back(corners.size());
    }
  }
  std::size_t begin = 0;
  for (const std::size_t end : ends) {
    cut_polygon(mesh.vertices, std::span(corners).subspan(begin, end - begin), mesh.faces);
    begin = end;
  }
  if (colors.size() == mesh.vertices.size())
    mesh.colors = linear_colors(colors, ColorScale::number);
  return mesh;
}

}  // namespace organbake
