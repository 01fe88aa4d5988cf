// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/grown_mesh.h"

#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "support/meshes.h"

namespace organbake {

unsigned Drawn::byte() {
  if (bytes_.empty()) return 0;
  const auto value = std::to_integer<unsigned>(bytes_.front());
  bytes_ = bytes_.subspan(1);
  return value;
}

unsigned Drawn::pair() {
  const unsigned low = byte();
  return low | byte() << 8;
}

std::size_t Drawn::below(std::size_t count) { return (count <= 256 ? byte() : pair()) % count; }

double Drawn::between(double low, double high) { return low + (high - low) * pair() / 65535.0; }

double Drawn::power_of_ten(double low, double high) { return std::pow(10.0, between(low, high)); }

double Drawn::odd_number() {
  using Limits = std::numeric_limits<double>;
  constexpr double kNumbers[] = {0,      Limits::quiet_NaN(),  Limits::infinity(), -1,    1e300,
                                 1e-300, Limits::denorm_min(), Limits::max(),      -1e300};
  return kNumbers[below(std::size(kNumbers))];
}

Eigen::Vector3d Drawn::vector(double most) {
  const double x = between(-most, most), y = between(-most, most);
  return {x, y, between(-most, most)};
}

namespace {

TriangleMesh base_mesh(Drawn& drawn) {
  switch (drawn.below(6)) {
    case 0:
      return lumpy_mesh(10, 1);
    case 1:
      return sphere_mesh(10, static_cast<int>(drawn.below(3)));
    case 2:
      return scaled(tetrahedron_mesh(), 10);
    case 3:
      return grid_box(Eigen::Vector3d(8, 10, 12), 1 + static_cast<int>(drawn.below(3)));
    case 4:
      return box_mesh({10, 10, drawn.between(0.01, 10)});
    default: {
      const double radius_mm = drawn.power_of_ten(-1, 2);
      return lumpy_mesh(radius_mm, static_cast<int>(drawn.below(3)));
    }
  }
}

// A vertex in the middle of a face: the mesh stays what it was.
void split_face(TriangleMesh& mesh, std::size_t at) {
  const Face face = mesh.faces[at];
  const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(
      (mesh.vertices[face[0]] + mesh.vertices[face[1]] + mesh.vertices[face[2]]) / 3);
  mesh.faces[at] = {face[0], face[1], middle};
  mesh.faces.push_back({face[1], face[2], middle});
  mesh.faces.push_back({face[2], face[0], middle});
}

void weld_vertices(TriangleMesh& mesh, std::uint32_t from, std::uint32_t to) {
  for (Face& face : mesh.faces) {
    for (std::uint32_t& corner : face)
      if (corner == from) corner = to;
  }
}

void change(TriangleMesh& mesh, Drawn& drawn) {
  const std::size_t kind = drawn.below(16);
  if (mesh.faces.empty()) return;
  const std::size_t face = drawn.below(mesh.faces.size());
  const std::uint32_t vertex = mesh.faces[face][0];
  if (vertex >= mesh.vertices.size()) return;  // of an earlier change
  for (const std::uint32_t corner : mesh.faces[face])
    if (corner >= mesh.vertices.size()) return;
  switch (kind) {
    case 0:
    case 1:
    case 2:
      mesh.vertices[vertex] += drawn.vector(10);
      break;
    case 3:
    case 4:
      split_face(mesh, face);
      break;
    case 5:
      mesh = scaled(mesh, drawn.power_of_ten(-6, 6));
      break;
    case 6:
      mesh = moved(mesh, drawn.vector(1e5));
      break;
    case 7:
      mesh = joined(mesh, moved(mesh, drawn.vector(30)));
      break;
    case 8: {
      const TriangleMesh other = base_mesh(drawn);
      mesh = joined(mesh, scaled(other, drawn.power_of_ten(-3, 1)));
      break;
    }
    case 9:
      weld_vertices(mesh, vertex, mesh.faces[drawn.below(mesh.faces.size())][1]);
      break;
    case 10:
      std::swap(mesh.faces[face][0], mesh.faces[face][1]);
      break;
    case 11:
      mesh.faces.push_back(mesh.faces[face]);
      break;
    case 12:
      mesh.faces.erase(mesh.faces.begin() + static_cast<std::ptrdiff_t>(face));
      break;
    case 13:
      for (Eigen::Vector3d& v : mesh.vertices) v.y() *= drawn.between(0, 1);
      break;
    case 14:
      mesh.vertices[vertex].x() = drawn.odd_number();
      break;
    default:
      mesh.faces[face][2] = static_cast<std::uint32_t>(drawn.below(4096));
  }
}

}  // namespace

TriangleMesh sound_mesh(Drawn& drawn) {
  TriangleMesh mesh = base_mesh(drawn);
  const Eigen::Vector3d center = bounds(mesh).center();
  for (std::size_t n = drawn.below(4); n-- > 0;) {
    const std::size_t at = drawn.below(mesh.vertices.size());
    mesh.vertices[at] = center + drawn.between(1, 2) * (mesh.vertices[at] - center);
  }
  return mesh;
}

TriangleMesh grown_mesh(Drawn& drawn) {
  TriangleMesh mesh = base_mesh(drawn);
  for (std::size_t n = drawn.below(8); n-- > 0;) change(mesh, drawn);
  return mesh;
}

}  // namespace organbake
