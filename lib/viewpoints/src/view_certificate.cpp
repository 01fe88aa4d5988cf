// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/viewpoints/view_certificate.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace organbake {
namespace {

struct Gap {
  double picture = 0, surface = 0;
};

Gap gap_of(const SampleBits& seen, const std::vector<SampleBits>& kept, const ViewWeights& three,
           const Eigen::Vector3d& eye, const SurfaceSamples& samples) {
  double picture = 0, missed_picture = 0;
  std::size_t count = 0, missed_count = 0;
  for (std::size_t w = 0; w < seen.words().size(); ++w) {
    std::uint64_t known = 0;
    for (const std::uint32_t camera : three.cameras) known |= kept[camera].words()[w];
    const std::uint64_t shown = seen.words()[w], missed = shown & ~known;
    count += std::popcount(shown);
    missed_count += std::popcount(missed);
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
  if (count == 0 || !(picture > 0)) return {};
  return {missed_picture / picture, static_cast<double>(missed_count) / static_cast<double>(count)};
}

}  // namespace

ViewCertificate certify_views(const ViewManifold& manifold, const std::vector<SampleBits>& kept,
                              const std::vector<Eigen::Vector3d>& views_mm,
                              const std::vector<SampleBits>& seen, const SurfaceSamples& samples) {
  std::vector<Gap> gaps(views_mm.size());
  tbb::parallel_for(std::size_t{0}, views_mm.size(), [&](std::size_t v) {
    const ViewWeights three = view_weights(manifold, views_mm[v] - manifold.center_world_mm);
    gaps[v] = gap_of(seen[v], kept, three, views_mm[v], samples);
  });
  ViewCertificate certificate;
  certificate.views = static_cast<int>(views_mm.size());
  for (const Gap& gap : gaps) {  // in order: the sum is the same for any number of threads
    certificate.gaps.push_back(gap.picture);
    certificate.mean_gap += gap.picture / static_cast<double>(gaps.size());
    certificate.mean_surface_gap += gap.surface / static_cast<double>(gaps.size());
    certificate.worst_gap = std::max(certificate.worst_gap, gap.picture);
  }
  return certificate;
}

}  // namespace organbake
