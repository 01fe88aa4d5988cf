// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// The original surface as a fit sees it: samples to be near to, and closest points.
class FitReference {
 public:
  // Samples come from `surface`, closest points from `thinned`, which stands for it: for proxies
  // far coarser than `thinned` the difference does not matter.
  FitReference(const TriangleMesh& surface, const TriangleMesh& thinned, std::size_t samples);

  const std::vector<Eigen::Vector3d>& samples() const { return samples_; }
  double sample_weight() const { return 1.0 / double(samples_.size()); }
  double area_mm2() const { return area_mm2_; }
  double volume_mm3() const { return volume_mm3_; }
  bool closed() const { return closed_; }

  ClosestPoint closest(const Eigen::Vector3d& point) const { return scene_->closest_point(point); }
  const Eigen::Vector3d& normal(std::uint32_t face) const { return (*normals_)[face]; }

  // The same with every k-th of the samples.
  FitReference every(std::size_t k) const;

  // Points on a proxy's face that are held against the surface: as dense as samples(), at least a
  // few; each stands for an equal share of the face's area.
  std::size_t points_on_face(double face_area_mm2) const;
  static Eigen::Vector3d weights_on_face(std::size_t i);  // barycentric, evenly spread

 private:
  std::vector<Eigen::Vector3d> samples_;
  double area_mm2_ = 0, volume_mm3_ = 0;
  bool closed_ = false;
  std::shared_ptr<const std::vector<Eigen::Vector3d>> normals_;
  std::shared_ptr<const RayScene> scene_;
};

}  // namespace organbake
