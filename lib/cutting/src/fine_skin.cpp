// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/fine_skin.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "edge_bisection.h"
#include "organbake/cutting/cut_skin.h"
#include "sheet_neighbourhood.h"

namespace organbake {
namespace {

constexpr std::size_t kMostFaces = 40'000;
constexpr std::uint32_t kRankOfSkinMiddles = 0xC000'0000;

std::vector<CutSheet::Triangle> in_tissue(std::span<const CutSheet::Triangle> triangles) {
  std::vector<CutSheet::Triangle> in;
  std::copy_if(triangles.begin(), triangles.end(), std::back_inserter(in),
               [](const CutSheet::Triangle& t) { return !t.farther_out; });
  return in;
}

// Where a vertex lies in a face that has since been halved: at one of its corners, or half-way
// between the ends of an edge that was.
Eigen::Vector2d place_in(const Face& face, std::uint32_t vertex, const Bisection& halved,
                         std::size_t first_halved) {
  const auto corner = std::find(face.begin(), face.end(), vertex);
  if (corner != face.end()) return kCornersInFace[static_cast<std::size_t>(corner - face.begin())];
  const auto [a, b] = halved.halved[vertex - first_halved];
  return 0.5 * (place_in(face, a, halved, first_halved) + place_in(face, b, halved, first_halved));
}

}  // namespace

FineSkin::FineSkin(TriangleMesh skin, const MaterialGrid& grid, std::uint32_t first_rank)
    : mesh_(std::move(skin)),
      grid_(grid),
      edges_(grid.snapped(mesh_.vertices, first_rank), edges_of(mesh_.faces)) {
  for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) parts_.push_back({f, kCornersInFace});
}

bool FineSkin::add(std::span<const CutSheet::Triangle> triangles, std::size_t first_new) {
  const bool finer = refine(triangles, first_new);
  return edges_.add(in_tissue(triangles.subspan(first_new))) || finer;
}

bool FineSkin::refine(std::span<const CutSheet::Triangle> triangles, std::size_t first_new) {
  const SheetNeighbourhood near(grid_, triangles.subspan(first_new));
  if (near.empty()) return false;
  const std::vector<Face> before = mesh_.faces;
  const std::size_t first_halved = mesh_.vertices.size();
  const Bisection halved = bisect(mesh_, [&](std::uint32_t f) {
    const auto& [a, b, c] = mesh_.faces[f];
    const std::array corners = {mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]};
    return mesh_.faces.size() < kMostFaces &&
           longest_edge_mm(mesh_, mesh_.faces[f]) > near.fine_mm(corners);
  });
  if (halved.none()) return false;
  std::vector<Part> parts;
  for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
    const Part& whole = parts_[halved.part_of[f]];
    Part& part = parts.emplace_back(whole);
    for (int k = 0; k < 3; ++k) {
      part.at[k] = within(
          whole.at, place_in(before[halved.part_of[f]], mesh_.faces[f][k], halved, first_halved));
    }
  }
  parts_ = std::move(parts);
  edges_ = edges_.finer(mesh_.vertices, grid_, kRankOfSkinMiddles, edges_of(mesh_.faces),
                        in_tissue(triangles.first(first_new)));
  return true;
}

}  // namespace organbake
