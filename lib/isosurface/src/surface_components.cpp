// SPDX-License-Identifier: GPL-3.0-or-later
// Connected pieces of a contour, by union of vertices, and which of them are kept. All in place: a
// contour may be as large as memory allows.
#include "surface_components.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "organbake/core/union_find.h"

namespace organbake {
namespace {

struct Component {
  double area = 0;         // twice, mm²
  double volume = 0;       // six times, mm³
  std::uint32_t root = 0;  // its smallest vertex
  Eigen::AlignedBox3d box;
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
      components.push_back({0, 0, root[face[0]], {}});
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

void apply(const ComponentFilter& filter, std::vector<Component>& components) {
  const bool any_outward = std::any_of(components.begin(), components.end(),
                                       [](const Component& c) { return c.volume > 0; });
  if (filter.outward_only && filter.largest > 0 && any_outward) {
    std::erase_if(components, [](const Component& c) { return c.volume <= 0; });
  }
  if (filter.min_size_mm > 0) {
    std::erase_if(components, [&](const Component& c) {
      return c.box.sizes().maxCoeff() < filter.min_size_mm;
    });
  }
  std::stable_sort(components.begin(), components.end(),
                   [](const Component& a, const Component& b) { return a.area > b.area; });
  if (filter.largest > 0) components.resize(std::min(filter.largest, components.size()));
}

// The solid that pieces are, or the area of open ones.
double amount(const std::vector<Component>& components, bool outward_only) {
  double volume = 0, area = 0;
  for (const Component& component : components) {
    volume += std::max(0.0, component.volume);
    area += component.area;
  }
  return outward_only ? volume : area;
}

}  // namespace

KeptComponents keep_components(TriangleMesh mesh, const ComponentFilter& filter) {
  const std::vector<std::uint32_t> root = label_vertices(mesh);
  std::size_t found = 0;
  for (std::uint32_t v = 0; v < root.size(); ++v) found += root[v] == v;
  const bool all = filter.largest == 0 || (filter.largest >= found && !filter.outward_only);
  if (filter.min_size_mm == 0 && (all || found <= 1)) return {std::move(mesh), found, found};
  std::vector<Component> components = measure(mesh, root);
  const double before = amount(components, filter.outward_only);
  apply(filter, components);
  const double left_out = before > 0 ? 1 - amount(components, filter.outward_only) / before : 0;
  if (components.size() == found) return {std::move(mesh), found, found};
  std::vector<bool> kept_root(mesh.vertices.size(), false);
  for (const Component& component : components) kept_root[component.root] = true;
  drop_others(mesh, root, kept_root);
  return {std::move(mesh), found, components.size(), std::max(0.0, left_out)};
}

}  // namespace organbake
