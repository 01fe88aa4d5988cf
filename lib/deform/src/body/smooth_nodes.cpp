// SPDX-License-Identifier: Apache-2.0
// Nodes of a smooth skin in the present pose, each worked out when it is first asked for. A stamp
// by node tells whether it belongs to this pose, so that a new pose costs nothing.
#include "body/skin.h"

#include <algorithm>
#include <cmath>

#include "organbake/geometry/smooth_skin.h"

namespace organbake::deform {

void SmoothNodes::add(const DeformBody& body, const std::uint32_t* slot_of_vertex) {
  const auto before = static_cast<std::uint32_t>(count());
  const SmoothSkin& skin = *body.skin;
  for (std::size_t n = 0; n < skin.node_count(); ++n) {
    for (std::uint32_t k = skin.first[n]; k < skin.first[n + 1]; ++k)
      carriers_.push_back({slot_of_vertex[skin.carrier[k]], skin.weight[k]});
    first_.push_back(static_cast<std::uint32_t>(carriers_.size()));
  }
  for (const Face& f : smooth_skin_faces(body.proxy, skin.steps))
    faces_.push_back({before + f[0], before + f[1], before + f[2]});
  faces_of_ = VertexFaces(faces_, count());
  points_.resize(count());
  normals_.resize(count());
  posed_points_.assign(count(), 0);
  posed_normals_.assign(count(), 0);
}

void SmoothNodes::pose(const PaddedVectors& x) {
  x_ = &x;
  if (++pose_ == 0) {  // the counter came round: no old stamp may look current
    std::fill(posed_points_.begin(), posed_points_.end(), 0u);
    std::fill(posed_normals_.begin(), posed_normals_.end(), 0u);
    pose_ = 1;
  }
}

const PaddedVector& SmoothNodes::point(std::uint32_t node) {
  if (posed_points_[node] != pose_) {
    const Double4* x = as_double4(x_->data());
    Double4 sum{};
    for (const auto& [slot, weight] : carriers(node)) sum += weight * x[slot];
    *as_double4(&points_[node]) = sum;
    posed_points_[node] = pose_;
  }
  return points_[node];
}

// The mean of the faces' normals by area. Weights by angle would change little, because the faces
// of a smooth skin are all about as large.
const PaddedVector& SmoothNodes::normal(std::uint32_t node) {
  if (posed_normals_[node] != pose_) {
    Double4 sum{};
    for (const std::uint32_t face : faces_of_.of(node)) {
      const Face& f = faces_[face];
      const Double4 a = *as_double4(&point(f[0])), b = *as_double4(&point(f[1])),
                    c = *as_double4(&point(f[2]));
      sum += cross(b - a, c - a);
    }
    const double length = std::sqrt(dot(sum, sum));
    normals_[node] = PaddedVector(0, 0, 1, 0);
    if (length > 0) *as_double4(&normals_[node]) = sum / length;
    posed_normals_[node] = pose_;
  }
  return normals_[node];
}

}  // namespace organbake::deform
