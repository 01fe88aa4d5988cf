// SPDX-License-Identifier: GPL-3.0-or-later
// The surface that a proxy is fitted to, as evenly spread samples and a search tree. Points on the
// proxy's faces follow a low-discrepancy sequence, so that few of them cover a face.
#include "fit_reference.h"

#include <algorithm>
#include <cmath>

#include "organbake/geometry/area_sampler.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

constexpr std::uint64_t kSeed = 0x6669'7473'616d'706c;

bool is_closed(const TriangleMesh& mesh) {
  const auto twins = manifold_twins(mesh);
  return twins && std::find(twins->begin(), twins->end(), kNoHalfEdge) == twins->end();
}

}  // namespace

FitReference::FitReference(const TriangleMesh& surface, const TriangleMesh& thinned,
                           std::size_t samples)
    : volume_mm3_(signed_volume(surface)),
      closed_(is_closed(thinned)),
      scene_(std::make_shared<RayScene>(thinned)) {
  const AreaSampler sample(surface, samples, kSeed);
  area_mm2_ = sample.area_mm2();
  samples_.reserve(samples);
  for (std::size_t i = 0; i < samples; ++i) samples_.push_back(sample(i));
  std::vector<Eigen::Vector3d> normals(thinned.faces.size());
  for (std::size_t f = 0; f < normals.size(); ++f) normals[f] = face_normal(thinned, f);
  normals_ = std::make_shared<std::vector<Eigen::Vector3d>>(std::move(normals));
}

FitReference FitReference::every(std::size_t k) const {
  FitReference result = *this;
  result.samples_.clear();
  for (std::size_t i = 0; i < samples_.size(); i += k) result.samples_.push_back(samples_[i]);
  return result;
}

std::size_t FitReference::points_on_face(double face_area_mm2) const {
  constexpr double kFewest = 4, kMost = 4096;
  const double even = face_area_mm2 / area_mm2_ * double(samples_.size());
  return static_cast<std::size_t>(std::clamp(std::round(even), kFewest, kMost));
}

// The R2 sequence (Roberts 2018) on the unit square, folded onto the triangle.
Eigen::Vector3d FitReference::weights_on_face(std::size_t i) {
  constexpr double kPlastic = 1.32471795724474602596;
  double u = std::fmod(0.5 + double(i + 1) / kPlastic, 1.0);
  double v = std::fmod(0.5 + double(i + 1) / (kPlastic * kPlastic), 1.0);
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  return {1 - u - v, u, v};
}

}  // namespace organbake
