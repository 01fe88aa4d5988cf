// SPDX-License-Identifier: GPL-3.0-or-later
#include "lattice_body.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"

namespace organbake {
namespace {

// Lines are moved aside by these shares of the spacing: meshes made by hand have edges right
// where a regular grid has its lines, and whether such an edge is hit would hang on rounding.
constexpr double kAsideY = 1.31e-3, kAsideZ = 2.17e-3;

struct Crossing {
  double x_mm;
  int leaves;  // 1: out of the body, −1: into it
};
using Lines = std::vector<std::vector<Crossing>>;

double cross2(double ay, double az, double by, double bz) { return ay * bz - az * by; }

// Adds the face's crossings to the lines that its projection along x covers.
void cross_face(const TriangleMesh& mesh, const Face& face, const SampleGrid& grid, Lines& lines) {
  const Eigen::Vector3d &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]],
                        &c = mesh.vertices[face[2]];
  const double area = cross2(b.y() - a.y(), b.z() - a.z(), c.y() - a.y(), c.z() - a.z());
  if (area == 0) return;
  const Eigen::Vector3d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const Eigen::Vector3d first =
      grid.first_mm + grid.spacing_mm * Eigen::Vector3d(0, kAsideY, kAsideZ);
  const auto range = [&](int axis) {
    const double from = (low[axis] - first[axis]) / grid.spacing_mm;
    const double to = (high[axis] - first[axis]) / grid.spacing_mm;
    return std::pair(std::max(0, static_cast<int>(std::ceil(from))),
                     std::min(grid.count[axis] - 1, static_cast<int>(std::floor(to))));
  };
  const auto [j0, j1] = range(1);
  const auto [k0, k1] = range(2);
  for (int k = k0; k <= k1; ++k) {
    for (int j = j0; j <= j1; ++j) {
      const double y = first.y() + j * grid.spacing_mm, z = first.z() + k * grid.spacing_mm;
      const double u = cross2(y - a.y(), z - a.z(), c.y() - a.y(), c.z() - a.z()) / area;
      const double v = cross2(b.y() - a.y(), b.z() - a.z(), y - a.y(), z - a.z()) / area;
      if (u < 0 || v < 0 || u + v > 1) continue;
      const double x = a.x() + u * (b.x() - a.x()) + v * (c.x() - a.x());
      lines[std::size_t(k) * grid.count.y() + j].push_back({x, area > 0 ? 1 : -1});
    }
  }
}

void require_closed(const std::vector<Crossing>& line) {
  int sum = 0;
  for (const Crossing& c : line) sum += c.leaves;
  if (sum == 0) return;
  throw BadDataError(
      "the proxy is not closed, so it has no inside for tetrahedra; bake without them (fem: "
      "false), or close the surface");
}

}  // namespace

std::vector<std::uint8_t> inside_samples(const TriangleMesh& mesh, const SampleGrid& grid) {
  Lines lines(std::size_t(grid.count.y()) * grid.count.z());
  for (const Face& face : mesh.faces) cross_face(mesh, face, grid, lines);
  std::vector<std::uint8_t> inside(grid.size(), 0);
  for (std::size_t l = 0; l < lines.size(); ++l) {
    std::vector<Crossing>& line = lines[l];
    require_closed(line);
    std::sort(line.begin(), line.end(),
              [](const Crossing& p, const Crossing& q) { return p.x_mm < q.x_mm; });
    int winding = 0;
    auto next = line.begin();
    for (int i = 0; i < grid.count.x(); ++i) {
      const double x = grid.first_mm.x() + i * grid.spacing_mm;
      for (; next != line.end() && next->x_mm <= x; ++next) winding -= next->leaves;
      inside[l * grid.count.x() + i] = winding != 0;
    }
  }
  return inside;
}

}  // namespace organbake
