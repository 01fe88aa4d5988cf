// SPDX-License-Identifier: GPL-3.0-or-later
// Distances of all views in a volume (Curless & Levoy 1996), the surface in it, and what makes that
// surface fit to be seen: its fringe trimmed, its edges made short enough for colours. Where the
// last view ends, its depth is the least sure and its pixels' steps become the surface's border. So
// the weights that the volume gathered are spread along the surface, the poorly seen rim is eaten
// from the border inwards, and the border is averaged along itself.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "organbake/contour/contour.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/fusion/fuse_views.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

constexpr int kEveryPixel = 4;  // of those that tell where the surface is

// Far in front of the surface a view says only that there is nothing.
constexpr double kEmptySpace = 0.2;  // of the weight near the surface

std::size_t voxels_of(const Eigen::Vector3d& extent_mm, double voxel_mm) {
  double count = 1;
  for (int i = 0; i < 3; ++i) count *= std::ceil(extent_mm[i] / voxel_mm) + 1;
  return count < 1e18 ? static_cast<std::size_t>(count) : std::size_t(-1);
}

// From corner to corner, one in a thousand points left out at either end.
Bounds bounds_of(const std::vector<SmoothView>& views) {
  std::array<std::vector<float>, 3> along;
  for (const SmoothView& view : views)
    for (int y = 0; y < view.depth_mm.height; y += kEveryPixel)
      for (int x = 0; x < view.depth_mm.width; x += kEveryPixel) {
        if (!(view.weight.at(x, y) > 0)) continue;
        const Eigen::Vector3d point = view.point_world_mm(x, y);
        for (int i = 0; i < 3; ++i) along[i].push_back(static_cast<float>(point[i]));
      }
  if (along[0].empty()) throw BadDataError("no depth map shows a surface");
  Bounds box;
  for (int i = 0; i < 3; ++i) {
    std::sort(along[i].begin(), along[i].end());
    const std::size_t stray = along[i].size() / 1000;
    box.min[i] = along[i][stray];
    box.max[i] = along[i][along[i].size() - 1 - stray];
  }
  return box;
}

// What one view says of a voxel: distance in truncations and weight.
void add_view(const SmoothView& view, const Eigen::Vector3d& at_mm, double truncation_mm,
              double& sum, double& weight) {
  const SeenSurface seen = seen_at(view, at_mm);
  if (!(seen.weight > 0)) return;
  const Eigen::Vector3d point = view.camera.camera_from_world * at_mm;
  const double cosine = std::clamp(-seen.normal_camera.dot(point) / point.norm(), 0.1, 1.0);
  // Along the ray, and from there to the surface's plane.
  const double off = (seen.depth_mm - seen.point_z_mm) * (point.norm() / point.z()) * cosine;
  if (off < -truncation_mm) return;
  const double share = off > truncation_mm ? kEmptySpace : 1;
  sum += share * seen.weight * std::min(1.0, off / truncation_mm);
  weight += share * seen.weight;
}

// Median distance on the surface between the views' pixels, or as many as were averaged.
double usual_pixel_mm(const std::vector<SmoothView>& views) {
  std::vector<double> sizes;
  for (const SmoothView& view : views)
    for (std::size_t k = 0; k < view.depth_mm.size(); k += 97)
      if (view.weight.values[k] > 0)
        sizes.push_back(view.resolution_px * view.depth_mm.values[k] / view.camera.intrinsics.fx);
  return median(std::move(sizes));
}

}  // namespace

VoxelBox box_round(const std::vector<SmoothView>& views, double voxel_mm) {
  constexpr double kMarginVoxels = 4;
  const Bounds seen = bounds_of(views);
  VoxelBox box;
  const auto extent_of = [&](double voxel) {
    return Eigen::Vector3d(seen.max - seen.min +
                           Eigen::Vector3d::Constant(2 * kMarginVoxels * voxel));
  };
  box.voxel_mm = voxel_mm;
  if (voxel_mm > 0) {
    const std::size_t count = voxels_of(extent_of(voxel_mm), voxel_mm);
    if (count > kMostVoxels)
      throw UsageError("voxel is " + to_text(voxel_mm) + " mm, which takes " +
                       std::to_string(count) + " voxels; at most " + std::to_string(kMostVoxels) +
                       " are possible here: give a larger one");
  } else {
    constexpr double kOfPixel = 1.5, kCoarser = 1.1, kLeast_mm = 0.05;
    box.voxel_mm = std::max(kLeast_mm, kOfPixel * usual_pixel_mm(views));
    while (voxels_of(extent_of(box.voxel_mm), box.voxel_mm) > kMostVoxels) box.voxel_mm *= kCoarser;
  }
  box.first_mm = seen.min - Eigen::Vector3d::Constant(kMarginVoxels * box.voxel_mm);
  const Eigen::Vector3d extent = extent_of(box.voxel_mm);
  for (int i = 0; i < 3; ++i)
    box.size[i] = static_cast<int>(std::ceil(extent[i] / box.voxel_mm)) + 1;
  return box;
}

DistanceVolume fuse_distances(const std::vector<SmoothView>& views, const VoxelBox& box,
                              double truncation_mm, const RunContext& context) {
  DistanceVolume volume{box, truncation_mm, std::vector<float>(box.voxels(), 0),
                        std::vector<float>(box.voxels(), 0)};
  parallel_for(0, box.size[2], [&](int z) {
    context.throw_if_cancelled();
    for (int y = 0; y < box.size[1]; ++y)
      for (int x = 0; x < box.size[0]; ++x) {
        const Eigen::Vector3d at = box.first_mm + box.voxel_mm * Eigen::Vector3d(x, y, z);
        double sum = 0, weight = 0;
        for (const SmoothView& view : views) add_view(view, at, truncation_mm, sum, weight);
        if (!(weight > 0)) continue;
        const std::size_t k = box.index(x, y, z);
        volume.distance[k] = static_cast<float>(sum / weight);
        volume.weight[k] = static_cast<float>(weight);
      }
  });
  return volume;
}

TriangleMesh surface_of(const DistanceVolume& volume, Holes holes) {
  const VoxelBox& box = volume.box;
  // contour() looks from values above the level to those below: inside is above. Values keep away
  // from the level as it asks.
  std::vector<float> inside(volume.distance.size());
  const auto least = static_cast<float>(2 * least_distance_to_level(box.size));
  for (std::size_t k = 0; k < inside.size(); ++k) {
    const float value = volume.weight[k] > 0 ? -volume.distance[k] : 1;
    inside[k] = std::abs(value) < least ? (value < 0 ? -least : least) : value;
  }
  if (holes == Holes::closed)
    for (int z = 0; z < box.size[2]; ++z)
      for (int y = 0; y < box.size[1]; ++y)
        for (int x = 0; x < box.size[0]; ++x)
          if (x == 0 || y == 0 || z == 0 || x + 1 == box.size[0] || y + 1 == box.size[1] ||
              z + 1 == box.size[2])
            inside[box.index(x, y, z)] = -1;
  TriangleMesh mesh = contour(std::span<const float>(inside), box.size, 0);
  if (holes == Holes::open) {
    const auto seen_around = [&](const Face& face) {
      Eigen::Vector3d centre = Eigen::Vector3d::Zero();
      for (const std::uint32_t corner : face) centre += mesh.vertices[corner] / 3;
      for (int i = 0; i < 8; ++i) {
        const int x = static_cast<int>(centre.x()) + i % 2,
                  y = static_cast<int>(centre.y()) + i / 2 % 2,
                  z = static_cast<int>(centre.z()) + i / 4;
        if (!(volume.weight[box.index(x, y, z)] > 0)) return false;
      }
      return true;
    };
    std::erase_if(mesh.faces, [&](const Face& face) { return !seen_around(face); });
  }
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = box.first_mm + box.voxel_mm * vertex;
  return mesh;
}

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

namespace {

struct Neighbours {
  std::vector<Eigen::Vector3d> sum;
  std::vector<int> count;
};

Neighbours sums_of(const TriangleMesh& mesh) {
  Neighbours all{std::vector<Eigen::Vector3d>(mesh.vertices.size(), Eigen::Vector3d::Zero()),
                 std::vector<int>(mesh.vertices.size(), 0)};
  for (const Face& face : mesh.faces)
    for (int i = 0; i < 3; ++i) {
      all.sum[face[i]] += mesh.vertices[face[(i + 1) % 3]] + mesh.vertices[face[(i + 2) % 3]];
      all.count[face[i]] += 2;
    }
  return all;
}

std::vector<bool> on_border(const TriangleMesh& mesh) {
  std::vector<bool> border(mesh.vertices.size(), false);
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 1) border[uses[0].low] = border[uses[0].high] = true;
  });
  return border;
}

}  // namespace

// Rounds of shrinking and growing alike (Taubin 1995) take the corners that split faces leave, and
// keep the size.
TriangleMesh finer_surface(const TriangleMesh& coarse, double longest_mm) {
  TriangleMesh mesh = refine_edges(coarse, longest_mm).mesh;
  const std::vector<bool> border = on_border(mesh);
  constexpr int kRounds = 8;
  constexpr double kShrink = 0.5, kGrow = -0.53;
  for (int round = 0; round < kRounds; ++round)
    for (const double step : {kShrink, kGrow}) {
      const Neighbours around = sums_of(mesh);
      for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        if (!border[v] && around.count[v] > 0)
          mesh.vertices[v] += step * (around.sum[v] / around.count[v] - mesh.vertices[v]);
    }
  return mesh;
}

}  // namespace organbake
