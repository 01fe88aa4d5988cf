// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/viewpoints/sample_bits.h"

namespace organbake {

// Points spread evenly by area over a surface (world mm), neighbours in space near each other in
// the list: rays to them are then coherent.
struct SurfaceSamples {
  std::vector<std::uint32_t> faces;
  std::vector<Eigen::Vector3d> weights;  // of the faces' corners, sum 1
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;  // unit, of the faces

  std::size_t size() const { return points.size(); }
};

void append_sample(const SurfaceSamples& from, std::size_t i, SurfaceSamples& to);

// One random stream a sample. Throws BadDataError when the surface has no (finite) area.
SurfaceSamples sample_surface(const TriangleMesh& surface, std::size_t count, std::uint64_t seed);

// Where somebody looks from. The last two are asked only where texels are limited.
struct Eye {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d forward = Eigen::Vector3d::UnitZ();  // unit
  double focal_px = 0;
};

// The longest side of a texel's footprint on a surface at `point` with a unit normal: at the planar
// depth z it is z/f wide, and longer by the slant. Not positive behind the eye; `point` is seen
// from the front.
double texel_mm(const Eye& eye, const Eigen::Vector3d& point, const Eigen::Vector3d& normal);

// What counts as seen besides a free line of sight.
struct SightLimits {
  double least_cosine = 0;  // between the normal and the way to the eye, 0…1; always from the front
  double texel_mm = 0;      // longest side of a texel's footprint on the surface; 0 = any
};

// Lines of sight to samples of one surface. Queries are const and thread-safe.
class Sight {
 public:
  // Throws BadDataError as RayScene does.
  explicit Sight(const TriangleMesh& surface);

  // Which of the samples one eye sees; all of them may be asked, or those of `among`.
  SampleBits seen_from(const Eye& eye, const SurfaceSamples& samples, const SightLimits& limits,
                       const SampleBits* among = nullptr) const;
  // For each of several eyes, in parallel.
  std::vector<SampleBits> seen_from_each(const std::vector<Eye>& eyes,
                                         const SurfaceSamples& samples, const SightLimits& limits,
                                         const SampleBits* among = nullptr) const;
  // Which samples at least one of the eyes sees: far cheaper than asking for each, because a sample
  // is asked until it is seen.
  SampleBits seen_from_any(const std::vector<Eye>& eyes, const SurfaceSamples& samples,
                           const SightLimits& limits) const;

 private:
  RayScene scene_;
  double step_back_mm_;  // how far before a sample its line of sight ends
};

}  // namespace organbake
