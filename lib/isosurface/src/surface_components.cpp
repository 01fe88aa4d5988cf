// SPDX-License-Identifier: GPL-3.0-or-later
// Connected pieces of a contour, by union of vertices, and which of them are kept. All in place: a
// contour may be as large as memory allows. A closed piece is its outer wall with the walls of the
// cavities that lie in it.
#include "surface_steps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/core/union_find.h"

namespace organbake {
namespace {

// Of its piece's volume: a smaller cavity is a gap that whoever drew the label left, and is filled.
constexpr double kGap = 0.01;

struct Component {
  double area = 0;         // twice, mm²
  double volume = 0;       // six times, mm³
  std::uint32_t root = 0;  // its smallest vertex
  Eigen::AlignedBox3d box = {};
  double cavity_volume = 0;                  // of its cavities, below 0
  std::vector<std::uint32_t> cavities = {};  // their roots

  double solid() const { return volume + cavity_volume; }
};

// For every vertex the smallest vertex of its component.
std::vector<std::uint32_t> label_vertices(const TriangleMesh& mesh) {
  UnionFind joined(mesh.vertices.size());
  for (const Face& face : mesh.faces)
    for (int c = 1; c < 3; ++c) joined.join(face[0], face[c]);
  return std::move(joined).roots();
}

std::vector<Component> measure(const TriangleMesh& mesh, const std::vector<std::uint32_t>& root) {
  constexpr std::uint32_t kNone = ~0u;
  std::vector<std::uint32_t> number(mesh.vertices.size(), kNone);
  std::vector<Component> components;
  for (const Face& face : mesh.faces) {
    std::uint32_t& n = number[root[face[0]]];
    if (n == kNone) {
      n = static_cast<std::uint32_t>(components.size());
      components.push_back({.root = root[face[0]]});
    }
    const Eigen::Vector3d& a = mesh.vertices[face[0]];
    // Seen from the component's own vertex: far from the world's origin digits would cancel.
    const Eigen::Vector3d& origin = mesh.vertices[root[face[0]]];
    const Eigen::Vector3d cross = (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a);
    components[n].area += cross.norm();
    components[n].volume += (a - origin).dot(cross);
    for (const std::uint32_t corner : face) components[n].box.extend(mesh.vertices[corner]);
  }
  return components;
}

// In place, since a mesh may be as large as memory allows: what is kept moves towards the front.
void drop_others(TriangleMesh& mesh, const std::vector<std::uint32_t>& root,
                 const std::vector<bool>& kept_root) {
  std::vector<std::uint32_t> renumbered(mesh.vertices.size(), 0);
  std::uint32_t vertices = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!kept_root[root[v]]) continue;
    mesh.vertices[vertices] = mesh.vertices[v];
    renumbered[v] = vertices++;
  }
  std::size_t faces = 0;
  for (const Face& face : mesh.faces) {
    if (!kept_root[root[face[0]]]) continue;
    mesh.faces[faces++] = {renumbered[face[0]], renumbered[face[1]], renumbered[face[2]]};
  }
  mesh.vertices.resize(vertices);
  mesh.faces.resize(faces);
}

double longest_side(const Component& component) { return component.box.sizes().maxCoeff(); }

// How often the faces of a component wind about a point (van Oosterom, Strackee 1983).
double winding(const TriangleMesh& mesh, const std::vector<std::uint32_t>& root,
               std::uint32_t component, const Eigen::Vector3d& point) {
  double half_angles = 0;
  for (const Face& face : mesh.faces) {
    if (root[face[0]] != component) continue;
    const Eigen::Vector3d a = mesh.vertices[face[0]] - point, b = mesh.vertices[face[1]] - point,
                          c = mesh.vertices[face[2]] - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    half_angles +=
        std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return half_angles / (2 * std::numbers::pi);
}

// The innermost piece round a cavity. Boxes alone tell it mostly; a ring, say, has other pieces in
// its box.
Component& piece_round(const TriangleMesh& mesh, const std::vector<std::uint32_t>& root,
                       std::vector<Component>& pieces, const Component& cavity) {
  std::vector<Component*> round;
  for (Component& piece : pieces)
    if (piece.box.contains(cavity.box)) round.push_back(&piece);
  if (round.size() > 1) {
    std::erase_if(round, [&](const Component* piece) {
      return winding(mesh, root, piece->root, mesh.vertices[cavity.root]) < 0.5;
    });
  }
  const auto less = [](const Component* a, const Component* b) { return a->volume < b->volume; };
  return round.empty() ? pieces.front() : **std::min_element(round.begin(), round.end(), less);
}

// Pieces of negative volume are the walls of cavities: with the piece round them they stay, or they
// go. Where there is nothing but such, it is a solid inside out.
std::vector<Component> with_cavities(const TriangleMesh& mesh,
                                     const std::vector<std::uint32_t>& root,
                                     std::vector<Component> pieces, const ComponentFilter& filter) {
  const auto first_cavity = std::stable_partition(pieces.begin(), pieces.end(),
                                                  [](const Component& c) { return c.volume > 0; });
  if (filter.cavities == Cavities::none || first_cavity == pieces.begin()) return pieces;
  const std::vector<Component> cavities(first_cavity, pieces.end());
  pieces.erase(first_cavity, pieces.end());
  if (filter.cavities == Cavities::filled && filter.largest > 0) return pieces;
  for (const Component& cavity : cavities) {
    if (longest_side(cavity) < filter.min_size_mm) continue;
    Component& piece = piece_round(mesh, root, pieces, cavity);
    if (filter.largest > 0 && -cavity.volume < kGap * piece.volume) continue;
    piece.cavities.push_back(cavity.root);
    piece.cavity_volume += cavity.volume;
  }
  return pieces;
}

void keep_chosen(const ComponentFilter& filter, std::vector<Component>& pieces) {
  std::erase_if(pieces, [&](const Component& c) { return longest_side(c) < filter.min_size_mm; });
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Component& a, const Component& b) { return a.area > b.area; });
  if (filter.largest > 0) pieces.resize(std::min(filter.largest, pieces.size()));
}

// The solid that pieces are, or the area of open ones.
double amount(const std::vector<Component>& pieces, bool open) {
  double volume = 0, area = 0;
  for (const Component& piece : pieces) {
    volume += std::max(0.0, piece.solid());
    area += piece.area;
  }
  return open ? area : volume;
}

}  // namespace

KeptComponents keep_components(TriangleMesh mesh, const ComponentFilter& filter) {
  const std::vector<std::uint32_t> root = label_vertices(mesh);
  const bool open = filter.cavities == Cavities::none;
  std::vector<Component> pieces = with_cavities(mesh, root, measure(mesh, root), filter);
  const std::size_t found = pieces.size();
  const double before = amount(pieces, open);
  keep_chosen(filter, pieces);
  std::vector<bool> kept_root(mesh.vertices.size(), false);
  for (const Component& piece : pieces) {
    kept_root[piece.root] = true;
    for (const std::uint32_t cavity : piece.cavities) kept_root[cavity] = true;
  }
  drop_others(mesh, root, kept_root);
  const double left_out = before > 0 ? 1 - amount(pieces, open) / before : 0;
  return {std::move(mesh), found, pieces.size(), std::max(0.0, left_out)};
}

}  // namespace organbake
