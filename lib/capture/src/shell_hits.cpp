// SPDX-License-Identifier: GPL-3.0-or-later
// Where lines of the shell meet the surface, both ways along each, past faces that turn away: the
// nearest meeting whose normal agrees.
#include "shell_hits.h"

#include <algorithm>
#include <cmath>
#include <span>
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

using ShellLine = Lattice::ShellLine;

constexpr std::size_t kLinesAtOnce = 256;

// A stretch of lines, worked on together.
class LineBatch {
 public:
  LineBatch(std::span<const ShellLine> lines, std::span<RayHit> found, const TracedSurface& surface,
            double reach_mm)
      : lines_(lines), found_(found), surface_(surface), reach_mm_(reach_mm) {}

  void find() {
    cast(+1);
    cast(-1);
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (found_[i].face == kNoHit) take_closest(i);
    }
  }

 private:
  // Looks along all lines one way, past faces that turn away, and keeps what is nearer than the
  // find so far.
  void cast(int way) {
    // The surface may pass through the foot itself: start a little on the other side of it.
    const double behind = 1e-6 * reach_mm_;
    constexpr int kMostFacesPassed = 8;
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < lines_.size(); ++i) open.push_back(i);
    std::vector<double> from(lines_.size(), 0);
    for (int round = 0; round < kMostFacesPassed && !open.empty(); ++round) {
      std::vector<Ray> rays(open.size());
      std::vector<RayHit> hits(open.size());
      for (std::size_t k = 0; k < open.size(); ++k) {
        const ShellLine& line = lines_[open[k]];
        rays[k].direction = way * line.direction;
        rays[k].origin = line.foot - behind * rays[k].direction;
        rays[k].t_min = from[open[k]];
        rays[k].t_max = reach_mm_;
      }
      surface_.rays.first_hits(rays, hits);
      std::vector<std::size_t> still_open;
      for (std::size_t k = 0; k < open.size(); ++k) {
        if (hits[k].face == kNoHit) continue;
        if (surface_.normals.faces_against(hits[k].face, -lines_[open[k]].direction)) {
          keep_nearer(open[k], way * (hits[k].t - behind), hits[k]);
        } else {
          from[open[k]] = hits[k].t + behind;
          still_open.push_back(open[k]);
        }
      }
      open = std::move(still_open);
    }
  }

  void keep_nearer(std::size_t i, double height, RayHit hit) {
    if (found_[i].face != kNoHit && std::abs(found_[i].t) <= std::abs(height)) return;
    hit.t = height;
    found_[i] = hit;
  }

  void take_closest(std::size_t i) {
    const ShellLine& line = lines_[i];
    const ClosestPoint closest = surface_.rays.closest_point(line.foot);
    found_[i] = surface_.normals.hit_at(closest.face, closest.point);
    const double length2 = line.direction.squaredNorm();
    found_[i].t = length2 > 0 ? (closest.point - line.foot).dot(line.direction) / length2 : 0;
  }

  std::span<const ShellLine> lines_;
  std::span<RayHit> found_;
  const TracedSurface& surface_;
  double reach_mm_;
};

}  // namespace

double shell_reach_mm(const TriangleMesh& surface, const TriangleMesh& proxy) {
  constexpr std::size_t kProbes = 4000;
  constexpr double kRoom = 2.5;
  constexpr double kLeastShareOfSize = 1e-3;
  const RayScene proxy_scene(proxy);
  const std::size_t stride = std::max<std::size_t>(1, surface.vertices.size() / kProbes);
  const std::size_t probes = (surface.vertices.size() + stride - 1) / stride;
  std::vector<double> distances(probes);
  parallel_for(std::size_t{0}, probes, [&](std::size_t i) {
    distances[i] = proxy_scene.closest_point(surface.vertices[i * stride]).distance_mm;
  });
  return std::max(kRoom * *std::max_element(distances.begin(), distances.end()),
                  kLeastShareOfSize * bounds(proxy).diagonal());
}

std::vector<RayHit> shell_hits(const std::vector<ShellLine>& lines, const TracedSurface& surface,
                               double reach_mm, const RunContext& context) {
  std::vector<RayHit> hits(lines.size());
  const std::size_t batches = (lines.size() + kLinesAtOnce - 1) / kLinesAtOnce;
  parallel_for(std::size_t{0}, batches, [&](std::size_t b) {
    context.throw_if_cancelled();
    const std::size_t first = b * kLinesAtOnce;
    const std::size_t count = std::min(kLinesAtOnce, lines.size() - first);
    LineBatch(std::span(lines).subspan(first, count), std::span(hits).subspan(first, count),
              surface, reach_mm)
        .find();
  });
  return hits;
}

}  // namespace organbake
