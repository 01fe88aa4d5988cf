// SPDX-License-Identifier: GPL-3.0-or-later
#include "capture/base_layer_bake.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "capture/lattice.h"

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

// A stretch of nodes, worked on together.
class NodeBatch {
 public:
  NodeBatch(const BaseLayerScene& scene, const std::vector<ShellLine>& lines, std::size_t first,
            std::size_t count)
      : scene_(scene), lines_(lines), first_(first), count_(count), found_(count) {}

  void bake(NodeValues& values) {
    cast(+1);
    cast(-1);
    std::vector<Vector3d> points(count_), normals(count_);
    std::vector<RayHit> hits(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      if (found_[i].face == kNoHit) take_closest(i);
      points[i] = scene_.normals.point(found_[i]);
      normals[i] = scene_.normals.at(found_[i]);
      hits[i] = found_[i];
      values.height_mm[first_ + i] = found_[i].t;
      values.seen_by[first_ + i] = seen_by(points[i]);
    }
    std::vector<Eigen::Vector3f> colors;
    scene_.color.shade(points, normals, hits, colors);
    std::copy(colors.begin(), colors.end(), values.color.begin() + first_);
  }

 private:
  // Looks along all lines one way, past faces that turn away, and keeps what is nearer than the
  // find so far (height in found_.t).
  void cast(int way) {
    // The surface may pass through the foot itself: start a little on the other side of it.
    const double behind = 1e-6 * scene_.reach_mm;
    constexpr int kMostFacesPassed = 8;
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < count_; ++i) open.push_back(i);
    std::vector<double> from(count_, 0);
    for (int round = 0; round < kMostFacesPassed && !open.empty(); ++round) {
      std::vector<Ray> rays(open.size());
      std::vector<RayHit> hits(open.size());
      for (std::size_t k = 0; k < open.size(); ++k) {
        const ShellLine& line = lines_[first_ + open[k]];
        rays[k].direction = way * line.direction;
        rays[k].origin = line.foot - behind * rays[k].direction;
        rays[k].t_min = from[open[k]];
        rays[k].t_max = scene_.reach_mm;
      }
      scene_.rays.first_hits(rays, hits);
      std::vector<std::size_t> still_open;
      for (std::size_t k = 0; k < open.size(); ++k) {
        if (hits[k].face == kNoHit) continue;
        if (scene_.normals.faces_against(hits[k].face, -lines_[first_ + open[k]].direction)) {
          keep_nearer(open[k], way * (hits[k].t - behind), hits[k]);
        } else {
          from[open[k]] = hits[k].t + behind;
          still_open.push_back(open[k]);
        }
      }
      open = std::move(still_open);
    }
  }

  void keep_nearer(std::size_t i, double height_mm, RayHit hit) {
    if (found_[i].face != kNoHit && std::abs(found_[i].t) <= std::abs(height_mm)) return;
    hit.t = height_mm;
    found_[i] = hit;
  }

  void take_closest(std::size_t i) {
    const ShellLine& line = lines_[first_ + i];
    const ClosestPoint closest = scene_.rays.closest_point(line.foot);
    found_[i] = scene_.normals.hit_at(closest.face, closest.point);
    const double length2 = line.direction.squaredNorm();
    found_[i].t = length2 > 0 ? (closest.point - line.foot).dot(line.direction) / length2 : 0;
  }

  // A camera sees a point when its map has that depth there, with confidence.
  std::uint32_t seen_by(const Vector3d& point) const {
    constexpr float kSureConfidence = 0.5f;
    // Half a texel's diagonal off the texel's centre, on a surface seen at up to 70°.
    constexpr double kTexels = 2.5;
    std::uint32_t bits = 0;
    for (std::size_t c = 0; c < std::min(scene_.cameras.size(), kMostCameras); ++c) {
      const PosedCamera& camera = scene_.cameras[c];
      const CameraMaps& maps = scene_.maps[c];
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

  const BaseLayerScene& scene_;
  const std::vector<ShellLine>& lines_;
  std::size_t first_, count_;
  std::vector<RayHit> found_;  // t: the height
};

NodeValues bake_nodes(const BaseLayerScene& scene, const std::vector<ShellLine>& lines,
                      const RunContext& context) {
  NodeValues values;
  values.height_mm.resize(lines.size());
  values.color.resize(lines.size());
  values.seen_by.resize(lines.size());
  const std::size_t batches = (lines.size() + kNodesAtOnce - 1) / kNodesAtOnce;
  tbb::parallel_for(std::size_t{0}, batches, [&](std::size_t b) {
    context.throw_if_cancelled();
    const std::size_t first = b * kNodesAtOnce;
    const std::size_t count = std::min(kNodesAtOnce, lines.size() - first);
    NodeBatch(scene, lines, first, count).bake(values);
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
    for (std::uint32_t i = 0; i <= layer.steps; ++i)  // base_node_index's order
      for (std::uint32_t j = 0; i + j <= layer.steps; ++j) {
        const std::uint32_t node = lattice.node(face, i, j);
        layer.height_mm.push_back(static_cast<float>(values.height_mm[node]));
        layer.color.push_back(values.color[node]);
        layer.seen_by.push_back(values.seen_by[node]);
      }
  return layer;
}

}  // namespace organbake
