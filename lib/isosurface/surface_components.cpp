// SPDX-License-Identifier: GPL-3.0-or-later
#include "isosurface/surface_components.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

namespace organbake {
namespace {

struct Component {
  double area = 0;         // twice, mm²
  double volume = 0;       // six times, mm³
  std::uint32_t root = 0;  // its smallest vertex
};

// For every vertex the smallest vertex of its component.
std::vector<std::uint32_t> label_vertices(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto find = [&](std::uint32_t x) {
    while (parent[x] != x) x = parent[x] = parent[parent[x]];
    return x;
  };
  for (const Face& face : mesh.faces) {
    std::uint32_t a = find(face[0]);
    for (int c = 1; c < 3; ++c) {
      const std::uint32_t b = find(face[c]);
      // The smaller index leads, so a component's name does not depend on the order of its faces.
      parent[std::max(a, b)] = std::min(a, b);
      a = std::min(a, b);
    }
  }
  for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = parent[parent[v]];
  return parent;
}

std::vector<Component> measure(const TriangleMesh& mesh, const std::vector<std::uint32_t>& root) {
  constexpr std::uint32_t kNone = ~0u;
  std::vector<std::uint32_t> number(mesh.vertices.size(), kNone);
  std::vector<Component> components;
  for (const Face& face : mesh.faces) {
    std::uint32_t& n = number[root[face[0]]];
    if (n == kNone) {
      n = static_cast<std::uint32_t>(components.size());
      components.push_back({0, 0, root[face[0]]});
    }
    const Eigen::Vector3d& a = mesh.vertices[face[0]];
    // Seen from the component's own vertex: far from the world's origin digits would cancel.
    const Eigen::Vector3d& origin = mesh.vertices[root[face[0]]];
    const Eigen::Vector3d cross = (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a);
    components[n].area += cross.norm();
    components[n].volume += (a - origin).dot(cross);
  }
  return components;
}

TriangleMesh part_of(const TriangleMesh& mesh, const std::vector<std::uint32_t>& root,
                     const std::vector<bool>& kept_root) {
  TriangleMesh out;
  std::vector<std::uint32_t> renumbered(mesh.vertices.size(), 0);
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!kept_root[root[v]]) continue;
    renumbered[v] = static_cast<std::uint32_t>(out.vertices.size());
    out.vertices.push_back(mesh.vertices[v]);
  }
  for (const Face& face : mesh.faces) {
    if (!kept_root[root[face[0]]]) continue;
    out.faces.push_back({renumbered[face[0]], renumbered[face[1]], renumbered[face[2]]});
  }
  return out;
}

}  // namespace

KeptComponents keep_largest(TriangleMesh mesh, std::size_t count, bool outward_only) {
  const std::vector<std::uint32_t> root = label_vertices(mesh);
  std::size_t found = 0;
  for (std::uint32_t v = 0; v < root.size(); ++v) found += root[v] == v;
  const bool all = count == 0 || (count >= found && !outward_only);
  if (all || found <= 1) return {std::move(mesh), found, found};
  std::vector<Component> components = measure(mesh, root);
  const bool any_outward = std::any_of(components.begin(), components.end(),
                                       [](const Component& c) { return c.volume > 0; });
  if (outward_only && any_outward) {
    std::erase_if(components, [](const Component& c) { return c.volume <= 0; });
  }
  std::stable_sort(components.begin(), components.end(),
                   [](const Component& a, const Component& b) { return a.area > b.area; });
  components.resize(std::min(count, components.size()));
  if (components.size() == found) return {std::move(mesh), found, found};
  std::vector<bool> kept_root(mesh.vertices.size(), false);
  for (const Component& component : components) kept_root[component.root] = true;
  return {part_of(mesh, root, kept_root), found, components.size()};
}

}  // namespace organbake
