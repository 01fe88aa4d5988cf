// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair_steps.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/utility.h>

#include <algorithm>
#include <map>
#include <vector>

#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Loop = std::vector<std::uint32_t>;

// The rims of holes, each in the order in which faces that close it would wind.
std::vector<Loop> open_loops(const TriangleMesh& mesh) {
  std::map<std::uint32_t, std::uint32_t> next;  // against the faces' direction
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    const auto up = std::count_if(uses.begin(), uses.end(), [](auto& use) { return use.up(); });
    if (up == 0) next[uses[0].low] = uses[0].high;
    if (up == std::ssize(uses)) next[uses[0].high] = uses[0].low;
  });
  std::vector<Loop> loops;
  while (!next.empty()) {
    Loop& loop = loops.emplace_back();
    for (auto at = next.begin(); at != next.end();) {
      loop.push_back(at->first);
      const std::uint32_t following = at->second;
      next.erase(at);
      at = next.find(following);
    }
  }
  return loops;
}

double size_of(const TriangleMesh& mesh, const Loop& loop) {
  Bounds box;
  for (const std::uint32_t v : loop) box.add(mesh.vertices[v]);
  return box.diagonal();
}

bool close_loop(TriangleMesh& mesh, const Loop& loop) {
  if (loop.size() < 3) return false;
  if (loop.size() == 3) {  // there is but one way, even where the three lie on a line
    mesh.faces.push_back({loop[0], loop[1], loop[2]});
    return true;
  }
  std::vector<Kernel::Point_3> rim;
  for (const std::uint32_t v : loop) {
    rim.emplace_back(mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z());
  }
  std::vector<CGAL::Triple<int, int, int>> patch;
  CGAL::Polygon_mesh_processing::triangulate_hole_polyline(rim, std::back_inserter(patch));
  for (const auto& triangle : patch) {
    mesh.faces.push_back({loop[static_cast<std::size_t>(triangle.first)],
                          loop[static_cast<std::size_t>(triangle.second)],
                          loop[static_cast<std::size_t>(triangle.third)]});
  }
  return !patch.empty();
}

}  // namespace

ClosedHoles close_holes(TriangleMesh& mesh, double largest_mm) {
  ClosedHoles holes;
  for (const Loop& loop : open_loops(mesh)) {
    const bool closed = size_of(mesh, loop) <= largest_mm && close_loop(mesh, loop);
    ++(closed ? holes.closed : holes.left);
  }
  return holes;
}

}  // namespace organbake
