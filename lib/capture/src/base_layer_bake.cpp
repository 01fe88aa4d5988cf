// SPDX-License-Identifier: GPL-3.0-or-later
// The coarse coloured lattice over the proxy, drawn where no camera sees: node heights along shell
// lines, colours from the surface.
#include "base_layer_bake.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "organbake/core/parallel.h"
#include "organbake/geometry/lattice.h"
#include "shell_hits.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using ShellLine = Lattice::ShellLine;

constexpr std::size_t kMaxNodes = 1'000'000;
constexpr std::size_t kNodesAtOnce = 256;
constexpr std::size_t kMostCameras = 32;  // bits of seen_by

struct NodeValues {
  std::vector<double> height_mm;
  std::vector<Eigen::Vector3f> color;
  std::vector<std::uint32_t> seen_by;
};

// A camera sees a point when its map has that depth there, with confidence.
std::uint32_t seen_by(const BaseLayerScene& scene, const Vector3d& point) {
  constexpr float kSureConfidence = 0.5f;
  // Half a texel's diagonal off the texel's centre, on a surface seen at up to 70°.
  constexpr double kTexels = 2.5;
  std::uint32_t bits = 0;
  for (std::size_t c = 0; c < std::min(scene.cameras.size(), kMostCameras); ++c) {
    const PosedCamera& camera = scene.cameras[c];
    const CameraMaps& maps = scene.maps[c];
    const Vector3d in_camera = camera.camera_from_world * point;
    if (!(in_camera.z() > 0)) continue;
    const Eigen::Vector2d pixel = project(camera.intrinsics, in_camera);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < maps.width && pixel.y() < maps.height))
      continue;
    const auto texel = std::size_t(pixel.y()) * maps.width + std::size_t(pixel.x());
    const double tolerance = kTexels * in_camera.z() / camera.intrinsics.fx;
    if (maps.confidence[texel] > kSureConfidence &&
        std::abs(maps.depth_mm[texel] - in_camera.z()) <= tolerance)
      bits |= 1u << c;
  }
  return bits;
}

void bake_stretch(const BaseLayerScene& scene, std::span<const RayHit> hits, std::size_t first,
                  NodeValues& values) {
  std::vector<Vector3d> points(hits.size()), normals(hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    points[i] = scene.surface.normals.point(hits[i]);
    normals[i] = scene.surface.normals.at(hits[i]);
    values.height_mm[first + i] = hits[i].t;
    values.seen_by[first + i] = seen_by(scene, points[i]);
  }
  std::vector<Eigen::Vector3f> colors;
  scene.color.shade(points, normals, {hits.begin(), hits.end()}, colors);
  std::copy(colors.begin(), colors.end(), values.color.begin() + first);
}

NodeValues bake_nodes(const BaseLayerScene& scene, const std::vector<ShellLine>& lines,
                      const RunContext& context) {
  const std::vector<RayHit> hits = shell_hits(lines, scene.surface, scene.reach_mm, context);
  NodeValues values;
  values.height_mm.resize(lines.size());
  values.color.resize(lines.size());
  values.seen_by.resize(lines.size());
  const std::size_t batches = (lines.size() + kNodesAtOnce - 1) / kNodesAtOnce;
  parallel_for(std::size_t{0}, batches, [&](std::size_t b) {
    context.throw_if_cancelled();
    const std::size_t first = b * kNodesAtOnce;
    const std::size_t count = std::min(kNodesAtOnce, lines.size() - first);
    bake_stretch(scene, std::span(hits).subspan(first, count), first, values);
  });
  return values;
}

}  // namespace

BaseLayer bake_base_layer(const BaseLayerScene& scene, double step_mm, const RunContext& context) {
  const Lattice lattice(scene.proxy, lattice_steps(scene.proxy, step_mm, kMaxNodes));
  const NodeValues values = bake_nodes(scene, lattice.shell_lines(), context);

  BaseLayer layer;
  layer.steps = lattice.steps();
  layer.face_count = static_cast<std::uint32_t>(scene.proxy.faces.size());
  const std::size_t count = std::size_t(layer.face_count) * layer.nodes_per_face();
  layer.height_mm.reserve(count);
  layer.color.reserve(count);
  layer.seen_by.reserve(count);
  for (std::uint32_t face = 0; face < layer.face_count; ++face)
    each_node(layer.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t) {
      const std::uint32_t node = lattice.node(face, i, j);
      layer.height_mm.push_back(static_cast<float>(values.height_mm[node]));
      layer.color.push_back(values.color[node]);
      layer.seen_by.push_back(values.seen_by[node]);
    });
  return layer;
}

}  // namespace organbake
