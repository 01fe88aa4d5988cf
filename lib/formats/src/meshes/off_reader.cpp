// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshes/mesh_readers.h"
#include "organbake/geometry/polygon.h"
#include "organbake/geometry/written_color.h"
#include "text/text_scanner.h"

namespace organbake {
namespace {

std::size_t whole(const TextScanner& line, std::size_t word, double most) {
  const double value = line.number(word);
  if (!(value >= 0 && value <= most) || value != static_cast<double>(std::size_t(value)))
    line.fail("\"" + std::string(line.words()[word]) + "\" is not a count or index in range");
  return static_cast<std::size_t>(value);
}

}  // namespace

TriangleMesh parse_off(std::string_view text, const std::string& name) {
  TextScanner line(text, name);
  if (!line.next_line()) line.fail("is empty");
  const std::string kind(line.words()[0]);
  if (!kind.ends_with("OFF")) line.fail("is not an OFF file");
  if (kind.find('4') != std::string::npos || kind.find('n') != std::string::npos)
    line.fail("points of " + kind + " are not of three dimensions");
  if (line.words().size() > 1 && line.words()[1] == "BINARY")
    line.fail("binary OFF is not read; save it as text");
  std::size_t first = 1;  // the counts may stand beside the keyword
  if (line.words().size() < 3) {
    first = 0;
    if (!line.next_line()) line.fail("ends before its counts");
  }
  // Every row takes bytes, so a count beyond the file's size is a lie.
  const auto most = static_cast<double>(text.size());
  const std::size_t vertices = whole(line, first, most), faces = whole(line, first + 1, most);
  const bool has_normals = kind.find('N') != std::string::npos;
  const bool has_colors = kind.find('C') != std::string::npos;
  const std::size_t color_at = has_normals ? 6 : 3;

  TriangleMesh mesh;
  std::vector<Eigen::Vector3d> colors;
  for (std::size_t v = 0; v < vertices; ++v) {
    if (!line.next_line()) line.fail("ends after " + std::to_string(v) + " vertices");
    mesh.vertices.push_back(line.vector(0));
    if (has_colors) colors.push_back(line.vector(color_at));
  }
  for (std::size_t f = 0; f < faces; ++f) {
    if (!line.next_line()) line.fail("ends after " + std::to_string(f) + " faces");
    const std::size_t count = whole(line, 0, most);
    std::vector<std::uint32_t> polygon;
    for (std::size_t c = 1; c <= count; ++c)
      polygon.push_back(static_cast<std::uint32_t>(whole(line, c, double(vertices) - 1)));
    cut_polygon(mesh.vertices, polygon, mesh.faces);
  }
  mesh.colors = linear_colors(colors, ColorScale::number);
  return mesh;
}

}  // namespace organbake
