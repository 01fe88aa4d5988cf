// SPDX-License-Identifier: GPL-3.0-or-later
//
// Where the last view ends, its depth is the least sure and its pixels' steps become the surface's
// border. So the weights that the volume gathered are spread along the surface, the poorly seen rim
// is eaten from the border inwards, and the border is averaged along itself.
#include "trimmed_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "organbake/core/median.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

using Support = std::vector<float>;  // of each vertex

double weight_at(const DistanceVolume& volume, const Eigen::Vector3d& place_mm) {
  const VoxelBox& box = volume.box;
  const Eigen::Vector3d at = (place_mm - box.first_mm) / box.voxel_mm;
  std::array<int, 3> voxel{};
  for (int i = 0; i < 3; ++i)
    voxel[i] = std::clamp(static_cast<int>(std::lround(at[i])), 0, box.size[i] - 1);
  return volume.weight[box.index(voxel[0], voxel[1], voxel[2])];
}

Support support_of(const TriangleMesh& mesh, const DistanceVolume& volume) {
  Support support;
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    support.push_back(static_cast<float>(weight_at(volume, vertex)));
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    Support sum = support;
    std::vector<int> count(support.size(), 1);
    for (const Face& face : mesh.faces)
      for (int i = 0; i < 3; ++i)
        for (const int other : {1, 2}) {
          sum[face[i]] += support[face[(i + other) % 3]];
          ++count[face[i]];
        }
    for (std::size_t v = 0; v < support.size(); ++v)
      support[v] = sum[v] / static_cast<float>(count[v]);
  }
  return support;
}

// How many of each face's edges are a border.
std::vector<int> border_edges(const TriangleMesh& mesh) {
  std::vector<int> borders(mesh.faces.size(), 0);
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 1) ++borders[uses[0].face()];
  });
  return borders;
}

// One ring of faces after another, as long as the rim is poor; and whatever hangs on by one edge.
void eat_fringe(const Support& support, float least, TriangleMesh& mesh) {
  for (std::size_t before = 0; before != mesh.faces.size();) {
    before = mesh.faces.size();
    const std::vector<int> borders = border_edges(mesh);
    std::size_t at = 0;
    std::erase_if(mesh.faces, [&](const Face& face) {
      const int own = borders[at++];
      const float sum = support[face[0]] + support[face[1]] + support[face[2]];
      return own >= 2 || (own == 1 && sum < 3 * least);
    });
  }
}

void round_border(TriangleMesh& mesh) {
  std::vector<std::array<std::uint32_t, 2>> beside(mesh.vertices.size());
  std::vector<int> count(mesh.vertices.size(), 0);
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() != 1) return;
    for (const auto& [from, to] :
         {std::pair(uses[0].low, uses[0].high), std::pair(uses[0].high, uses[0].low)}) {
      if (count[from] < 2) beside[from][static_cast<std::size_t>(count[from])] = to;
      ++count[from];
    }
  });
  constexpr int kRounds = 6;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Eigen::Vector3d> before = mesh.vertices;
    for (std::size_t v = 0; v < before.size(); ++v)
      if (count[v] == 2)
        mesh.vertices[v] = 0.5 * before[v] + 0.25 * (before[beside[v][0]] + before[beside[v][1]]);
  }
}

}  // namespace

TriangleMesh trimmed_surface(TriangleMesh mesh, const DistanceVolume& volume,
                             double least_support) {
  const Support support = support_of(mesh, volume);
  eat_fringe(support, static_cast<float>(least_support) * median(support), mesh);
  round_border(mesh);
  return mesh;
}

}  // namespace organbake
