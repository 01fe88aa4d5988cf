// SPDX-License-Identifier: GPL-3.0-or-later
// Colours carried from where they are known to where they are not, ring by ring over the mesh, then
// smoothed: a diffusion that needs no solver and gives the same colours in any order.
#include "color_flood.h"

#include <algorithm>
#include <cstdint>

#include "organbake/core/error.h"
#include "organbake/geometry/adjacency.h"

namespace organbake {
namespace {

using Eigen::Vector3f;

constexpr int kSmoothingRounds = 40;

Vector3f mean_of_known(const std::vector<char>& known, const std::vector<Vector3f>& colors) {
  Vector3f sum = Vector3f::Zero();
  std::size_t count = 0;
  for (std::size_t v = 0; v < colors.size(); ++v)
    if (known[v]) {
      sum += colors[v];
      ++count;
    }
  if (count == 0)
    throw BadDataError(
        "no photograph sees the surface: check that poses and surface share one frame (mm, LPS)");
  return sum / static_cast<float>(count);
}

}  // namespace

void flood_colors(const TriangleMesh& mesh, const std::vector<char>& known,
                  std::vector<Vector3f>& colors) {
  const Vector3f elsewhere = mean_of_known(known, colors);
  const VertexNeighbours neighbours(mesh.faces, mesh.vertices.size());
  std::vector<char> reached = known;
  std::vector<std::uint32_t> front, carried;
  for (std::uint32_t v = 0; v < known.size(); ++v)
    if (known[v]) front.push_back(v);

  // Ring by ring: a whole ring is coloured from the rings before it, so order does not matter.
  while (!front.empty()) {
    std::vector<std::uint32_t> ring;
    for (const std::uint32_t v : front)
      for (const std::uint32_t n : neighbours.of(v))
        if (!reached[n]) ring.push_back(n);
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    for (const std::uint32_t v : ring) {
      Vector3f sum = Vector3f::Zero();
      int count = 0;
      for (const std::uint32_t n : neighbours.of(v))
        if (reached[n]) {
          sum += colors[n];
          ++count;
        }
      colors[v] = sum / static_cast<float>(count);
    }
    for (const std::uint32_t v : ring) reached[v] = 1;
    carried.insert(carried.end(), ring.begin(), ring.end());
    front = std::move(ring);
  }
  for (std::size_t v = 0; v < colors.size(); ++v)
    if (!reached[v]) colors[v] = elsewhere;

  std::vector<Vector3f> next(carried.size());
  for (int round = 0; round < kSmoothingRounds; ++round) {
    for (std::size_t i = 0; i < carried.size(); ++i) {
      Vector3f sum = Vector3f::Zero();
      for (const std::uint32_t n : neighbours.of(carried[i])) sum += colors[n];
      next[i] = sum / static_cast<float>(neighbours.of(carried[i]).size());
    }
    for (std::size_t i = 0; i < carried.size(); ++i) colors[carried[i]] = next[i];
  }
}

}  // namespace organbake
