// SPDX-License-Identifier: GPL-3.0-or-later
// What a placement shows, measured on samples and views that had no part in making it, at rest and
// poked.
#include "organbake/viewpoints/placement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "placing.h"

namespace organbake {
namespace {

constexpr std::uint64_t kCoverageSeed = 4, kCertificateSeed = 5;
constexpr std::size_t kCoverageSamples = 16384, kCertificateSamples = 2048;
constexpr int kBriefly = 4;  // a brief report samples so many times fewer
constexpr int kCertificateViews = 600, kPokedViews = 128;
using Eyes = std::vector<Eye>;

// Views of the region at the cameras' distance, with the focal length that a camera there has.
Eyes region_eyes(int count, const Placement& placement, const PlacementOptions& options) {
  const ViewManifold& manifold = placement.manifold;
  const ViewingCone region = options.region();
  const PosedCamera& first = placement.cameras.front();
  const double distance = (first.center_world_mm() - manifold.center_world_mm).norm();
  Eyes eyes;
  for (const Eigen::Vector3d& d :
       lattice_directions(count, region.axis, region.half_angle_rad, LatticeKind::off_rim)) {
    eyes.push_back({manifold.center_world_mm + distance * d, -d, first.intrinsics.fx});
  }
  return eyes;
}

Eyes camera_eyes(const Placement& placement) {
  Eyes eyes;
  for (const PosedCamera& camera : placement.cameras) {
    eyes.push_back({camera.center_world_mm(), camera.view_direction_world(), camera.intrinsics.fx});
  }
  return eyes;
}

std::vector<Eigen::Vector3d> positions(const Eyes& eyes) {
  std::vector<Eigen::Vector3d> positions;
  for (const Eye& eye : eyes) positions.push_back(eye.position_mm);
  return positions;
}

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

std::array<double, 3> seen_shares(const std::vector<SampleBits>& seen, const SampleBits& among) {
  std::array<std::size_t, 3> counts = {};
  for (std::size_t i = 0; i < among.size(); ++i) {
    if (!among.test(i)) continue;
    const int times = times_in(seen, i, 3);
    for (int k = 0; k < times; ++k) ++counts[k];
  }
  std::array<double, 3> shares = {};
  for (std::size_t k = 0; k < 3; ++k) shares[k] = share(counts[k], among.count());
  return shares;
}

// Of the finest texel on each sample: the map with the best look at it counts.
double median_finest_texel_mm(const Eyes& cameras, const std::vector<SampleBits>& seen,
                              const SurfaceSamples& samples) {
  std::vector<double> finest;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      if (!seen[c].test(i)) continue;
      least = std::min(least, texel_mm(cameras[c], samples.points[i], samples.normals[i]));
    }
    if (std::isfinite(least)) finest.push_back(least);
  }
  return finest.empty() ? 0 : median(std::move(finest));
}

// The same places on the surface after its vertices moved.
SurfaceSamples moved_samples(SurfaceSamples samples, const TriangleMesh& moved) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Face& face = moved.faces[samples.faces[i]];
    const Eigen::Vector3d& weights = samples.weights[i];
    samples.points[i] = weights[0] * moved.vertices[face[0]] +
                        weights[1] * moved.vertices[face[1]] + weights[2] * moved.vertices[face[2]];
    samples.normals[i] = face_normal(moved, samples.faces[i]);
  }
  return samples;
}

// Where a view's centre line comes nearest to a sample that it sees, pushed along that line.
Poke poke_from(const Eye& eye, const SurfaceSamples& samples, const SampleBits& seen,
               double depth_mm) {
  constexpr double kSigma = 0.8;  // of the depth: steep, but without folds
  Poke poke{eye.position_mm, depth_mm * eye.forward, kSigma * depth_mm};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!seen.test(i)) continue;
    const double off_line = (samples.points[i] - eye.position_mm).cross(eye.forward).norm();
    if (off_line >= least) continue;
    least = off_line;
    poke.site_mm = samples.points[i];
  }
  return poke;
}

// The organ is poked where three of the views look, and seen anew; the maps are those of the organ
// at rest.
void measure_views(const TriangleMesh& surface, const Sight& sight, const Placement& placement,
                   const PlacementOptions& options, const RunContext& context,
                   CoverageReport& report) {
  const SurfaceSamples samples = sample_surface(surface, kCertificateSamples, kCertificateSeed);
  const std::vector<SampleBits> kept = sight.seen_from_each(camera_eyes(placement), samples, {});
  const Eyes views = region_eyes(kCertificateViews, placement, options);
  const std::vector<SampleBits> shown = sight.seen_from_each(views, samples, {});
  report.at_rest = certify_views(placement.manifold, kept, positions(views), shown, samples);
  const Eyes some = region_eyes(kPokedViews, placement, options);
  const double size = bounds(surface).diagonal();
  for (const std::size_t percent : {10, 20, 30}) {
    context.throw_if_cancelled();
    const std::size_t from = views.size() * percent / 40;  // three sides
    const TriangleMesh poked = poked_surface(
        surface,
        poke_from(views[from], samples, shown[from], 0.01 * static_cast<double>(percent) * size));
    const SurfaceSamples moved = moved_samples(samples, poked);
    report.poked.push_back(certify_views(placement.manifold, kept, positions(some),
                                         Sight(poked).seen_from_each(some, moved, {}), moved));
  }
}

// What a view shows and none of its three cameras has, as a share of what it shows, by the area in
// the picture: slivers at the outline hardly count.
double gap_of(const SampleBits& seen, const std::vector<SampleBits>& kept, const ViewWeights& three,
              const Eigen::Vector3d& eye, const SurfaceSamples& samples) {
  double picture = 0, missed_picture = 0;
  for (std::size_t w = 0; w < seen.words().size(); ++w) {
    std::uint64_t known = 0;
    for (const std::uint32_t camera : three.cameras) known |= kept[camera].words()[w];
    const std::uint64_t shown = seen.words()[w], missed = shown & ~known;
    for (std::uint64_t bits = shown; bits; bits &= bits - 1) {
      const std::size_t i = w * SampleBits::kWordBits + std::countr_zero(bits);
      const Eigen::Vector3d arm = eye - samples.points[i];
      const double distance2 = arm.squaredNorm();
      // Solid angle of an equal share of the surface.
      const double area = arm.dot(samples.normals[i]) / (distance2 * std::sqrt(distance2));
      picture += area;
      if (missed & bits & -bits) missed_picture += area;
    }
  }
  return picture > 0 ? missed_picture / picture : 0;
}

// The surface, a colour a vertex by how many of the cameras show it well: red = none, yellow = one,
// green = two, blue = three or more; grey = none of the region's views does.
TriangleMesh painted_by_cameras(const TriangleMesh& surface, const Sight& sight,
                                const std::vector<Eye>& cameras, const std::vector<Eye>& region,
                                const SightLimits& well) {
  static const Eigen::Vector3f kUnreachable(0.2f, 0.2f, 0.2f);
  static const std::array<Eigen::Vector3f, 4> kByCameras = {
      Eigen::Vector3f(0.8f, 0.03f, 0.03f), Eigen::Vector3f(0.8f, 0.6f, 0.05f),
      Eigen::Vector3f(0.1f, 0.5f, 0.15f), Eigen::Vector3f(0.08f, 0.2f, 0.6f)};
  SurfaceSamples vertices;
  vertices.points = surface.vertices;
  vertices.normals = vertex_normals(surface);
  const std::vector<SampleBits> seen = sight.seen_from_each(cameras, vertices, well);
  const SampleBits reachable = sight.seen_from_any(region, vertices, well);
  TriangleMesh painted = surface;
  painted.colors.clear();
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const int times = times_in(seen, v, static_cast<int>(kByCameras.size()) - 1);
    painted.colors.push_back(times == 0 && !reachable.test(v) ? kUnreachable : kByCameras[times]);
  }
  return painted;
}

}  // namespace

CoverageReport measure_coverage(const TriangleMesh& surface, const Placement& placement,
                                const PlacementOptions& options, CoverageDetail detail,
                                const RunContext& context) {
  const int fewer = detail == CoverageDetail::brief ? kBriefly : 1;
  CoverageReport report;
  const Sight sight(surface);
  const SightLimits well{kLeastSeenCosine, options.coverage ? options.coverage->texel_mm : 0};
  const Eyes region = region_eyes(kRegionViews / fewer, placement, options);
  const Eyes cameras = camera_eyes(placement);

  const SurfaceSamples samples = sample_surface(surface, kCoverageSamples / fewer, kCoverageSeed);
  const SampleBits reachable = sight.seen_from_any(region, samples, well);
  report.reachable_share = share(reachable.count(), samples.size());
  report.hidden_share = 1 - share(sight.seen_from_any(region, samples, {}).count(), samples.size());
  context.throw_if_cancelled();
  const std::vector<SampleBits> seen = sight.seen_from_each(cameras, samples, well);
  report.seen_share = seen_shares(seen, reachable);
  report.median_texel_mm = median_finest_texel_mm(cameras, seen, samples);
  if (detail == CoverageDetail::brief) return report;
  measure_views(surface, sight, placement, options, context, report);
  report.painted = painted_by_cameras(surface, sight, cameras, region, well);
  return report;
}

ViewCertificate certify_views(const ViewManifold& manifold, const std::vector<SampleBits>& kept,
                              const std::vector<Eigen::Vector3d>& views_mm,
                              const std::vector<SampleBits>& seen, const SurfaceSamples& samples) {
  ViewCertificate certificate;
  std::vector<double>& gaps = certificate.gaps;
  gaps.resize(views_mm.size());
  parallel_for(std::size_t{0}, views_mm.size(), [&](std::size_t v) {
    const ViewWeights three = view_weights(manifold, views_mm[v] - manifold.center_world_mm);
    gaps[v] = gap_of(seen[v], kept, three, views_mm[v], samples);
  });
  // In order: the sum is the same for any number of threads.
  for (const double gap : gaps) certificate.mean_gap += gap / static_cast<double>(gaps.size());
  return certificate;
}

TriangleMesh poked_surface(TriangleMesh surface, const Poke& poke) {
  const double falloff = 0.5 / (poke.sigma_mm * poke.sigma_mm);
  for (Eigen::Vector3d& vertex : surface.vertices) {
    vertex += std::exp(-falloff * (vertex - poke.site_mm).squaredNorm()) * poke.displacement_mm;
  }
  return surface;
}

}  // namespace organbake
