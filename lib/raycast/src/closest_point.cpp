// SPDX-License-Identifier: GPL-3.0-or-later
#include <embree3/rtcore.h>

#include <cmath>

#include "ray_scene_impl.h"

namespace organbake {
namespace {

// Bound on float rounding of coordinates in a scene of half-size 1…2, with a reserve of 4.
constexpr double kFloatRounding = 5e-7;
// Query points farther than this (in half-sizes) leave a float search nothing to go by.
constexpr double kFarAway = 1e5;

struct Nearest {
  const TracedMesh& mesh;
  Eigen::Vector3d query;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double distance2 = std::numeric_limits<double>::infinity();
  std::uint32_t face = kNoHit;

  bool consider(std::uint32_t candidate) {
    const Eigen::Vector3d p = closest_on_face(mesh.corners(candidate), query);
    const double d2 = (p - query).squaredNorm();
    if (d2 > distance2 || (d2 == distance2 && candidate > face)) return false;
    const bool nearer = d2 < distance2;
    point = p;
    distance2 = d2;
    face = candidate;
    return nearer;
  }
};

bool visit_face(RTCPointQueryFunctionArguments* arguments) {
  auto& nearest = *static_cast<Nearest*>(arguments->userPtr);
  if (!nearest.consider(arguments->primID)) return false;
  // Wide enough that float rounding hides no nearer face, nor an equally near one.
  const double rounding = kFloatRounding * (4 + nearest.query.cwiseAbs().maxCoeff());
  arguments->query->radius = static_cast<float>(std::sqrt(nearest.distance2) + rounding);
  return true;
}

}  // namespace

ClosestPoint RayScene::closest_point(const Eigen::Vector3d& point) const {
  if (!point.allFinite()) return {};
  const TracedMesh& mesh = impl_->mesh;
  Nearest nearest{.mesh = mesh, .query = mesh.scale * (point - mesh.center)};
  const double distance = nearest.query.norm();
  if (!std::isfinite(distance)) return {};
  if (distance > kFarAway) {
    for (std::uint32_t face = 0; face < mesh.faces.size(); ++face) nearest.consider(face);
  } else {
    const Eigen::Vector3f at = nearest.query.cast<float>();
    RTCPointQuery query{at.x(), at.y(), at.z(), 0, std::numeric_limits<float>::infinity()};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(mesh.scene.get(), &query, &context, visit_face, &nearest);
  }
  return {nearest.face, nearest.point / mesh.scale + mesh.center,
          std::sqrt(nearest.distance2) / mesh.scale};
}

}  // namespace organbake
