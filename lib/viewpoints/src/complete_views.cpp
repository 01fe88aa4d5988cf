// SPDX-License-Identifier: GPL-3.0-or-later
#include "cover_cameras.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "organbake/viewpoints/view_certificate.h"

namespace organbake {
namespace {

using Directions = CoverScene::Directions;

// A few at a time, apart from each other and from the cameras there are.
Directions worst_views(const CoverScene& scene, const Directions& cameras, const Directions& views,
                       const std::vector<double>& gaps) {
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return gaps[a] > gaps[b]; });
  Directions taken = cameras, more;
  const double apart_rad = 0.7 * scene.spacing_rad(cameras.size());
  const std::size_t most = std::min(1 + cameras.size() / 10, kMostCoverCameras - cameras.size());
  for (const std::size_t v : order) {
    if (more.size() >= most || !(gaps[v] > 0)) break;
    const bool free = std::none_of(taken.begin(), taken.end(), [&](const Eigen::Vector3d& d) {
      const double near_rad = more.empty() ? 0.3 * apart_rad : apart_rad;
      return d.dot(views[v]) > std::cos(near_rad);
    });
    if (!free) continue;
    taken.push_back(views[v]);
    more.push_back(views[v]);
  }
  return more;
}

}  // namespace

Placement complete_views(const CoverScene& scene, const Directions& given) {
  constexpr std::uint64_t kViewSeed = 3;
  constexpr std::size_t kViewSamples = 2048;
  constexpr int kCertificateViews = 512;
  constexpr double kSpare = 0.9;  // the samples of a report are others: a little to spare
  Placement placement = scene.placed(given);
  if (scene.goal().view_gap >= 1) return placement;
  const SurfaceSamples samples = scene.samples(kViewSamples, kViewSeed);
  const Directions views = scene.views(kCertificateViews);
  std::vector<Eigen::Vector3d> eyes_mm;
  for (const Eigen::Vector3d& view : views) eyes_mm.push_back(scene.eye_mm(view));
  const std::vector<SampleBits> seen = scene.visible(views, samples);
  Directions cameras = given;
  std::vector<SampleBits> kept = scene.visible(cameras, samples);
  while (cameras.size() < kMostCoverCameras) {
    scene.context().throw_if_cancelled();
    const ViewCertificate certificate =
        certify_views(placement.manifold, kept, eyes_mm, seen, samples);
    if (certificate.mean_gap <= kSpare * scene.goal().view_gap) break;
    const Directions more = worst_views(scene, cameras, views, certificate.gaps);
    if (more.empty()) break;
    const std::vector<SampleBits> theirs = scene.visible(more, samples);
    cameras.insert(cameras.end(), more.begin(), more.end());
    kept.insert(kept.end(), theirs.begin(), theirs.end());
    placement = scene.placed(cameras);
  }
  return placement;
}

}  // namespace organbake
