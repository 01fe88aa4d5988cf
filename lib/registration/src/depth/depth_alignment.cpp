// SPDX-License-Identifier: GPL-3.0-or-later
// Iterated closest points, point to plane (Chen & Medioni 1992), robust and with a scale. Which
// points see the surface at all is unknown: those whose nearest place is a cut or faces elsewhere
// (the walls behind an organ lie nearest to its flanks; Rusinkiewicz & Levoy 2001, 3.2, 3.4), and
// those that the surface would hide, draw at nothing, but they cost as much as the farthest, so
// that nothing is gained by showing less.
#include "depth/depth_alignment.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "cost_functions/cost_functions.h"
#include "organbake/core/quantile.h"
#include "organbake/geometry/dense_solve.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Normal7 = Eigen::Matrix<double, 7, 7>;
using Column7 = Eigen::Matrix<double, 7, 1>;

constexpr float kAtBorder_mm = 0.3F;

// The closest point as a hit of its face, for what is interpolated over that.
RayHit as_hit(const TriangleMesh& mesh, const ClosestPoint& closest) {
  const Face& face = mesh.faces[closest.face];
  const Vector3d& a = mesh.vertices[face[0]];
  const Vector3d ab = mesh.vertices[face[1]] - a, ac = mesh.vertices[face[2]] - a;
  const Vector3d ap = closest.point - a;
  const double bb = ab.dot(ab), bc = ab.dot(ac), cc = ac.dot(ac), pb = ap.dot(ab), pc = ap.dot(ac);
  const double area2 = bb * cc - bc * bc;
  RayHit hit;
  hit.face = closest.face;
  if (!(area2 > 0)) return hit;
  hit.u = static_cast<float>(std::clamp((cc * pb - bc * pc) / area2, 0.0, 1.0));
  hit.v = static_cast<float>(std::clamp((bb * pc - bc * pb) / area2, 0.0, 1.0 - hit.u));
  return hit;
}

DepthMatch match_point(const RegisteredSurface& surface, const Vector3d& eye_world,
                       const Vector3d& point_world, const Vector3d& seen_normal_world,
                       const RayHit& first, std::uint32_t likely_face) {
  // A surface that hides what is seen: seen askew, its distance along the ray is up to so many
  // times that to its nearest place.
  constexpr double kAskew = 3, kSlack = 0.01;
  constexpr double kLeastAlike = 0.5;  // cosine: noise and a start that is turned
  DepthMatch match;
  const ClosestPoint closest = surface.scene().closest_point(point_world, likely_face);
  match.nearest_face = closest.face;
  if (closest.face == kNoHit) return match;
  const Vector3d way = point_world - eye_world;
  const double hidden = first.face == kNoHit ? 0 : (1 - first.t) * way.norm();
  if (hidden > kAskew * closest.distance_mm + kSlack * way.norm()) {
    match.kind = DepthMatch::Kind::in_front;
    return match;
  }
  const RayHit hit = as_hit(surface.mesh(), closest);
  if (surface.border_distance_mm(hit) < kAtBorder_mm) return match;
  match.normal_world = surface.skin(hit, way).normal;
  const bool tells = !seen_normal_world.isZero();
  if (tells && match.normal_world.dot(seen_normal_world) < kLeastAlike) return match;
  match.kind = DepthMatch::Kind::on;
  match.place_world = closest.point;
  return match;
}

// Of Welsch's kind: what lies a few reaches off is worth as little as what lies nowhere, or many
// points that fit a little would outweigh few that fit well.
double robust_cost(double distance, double reach) {
  return 1 - std::exp(-0.5 * distance * distance / (reach * reach));
}

struct System {
  Normal7 normal = Normal7::Zero();
  Column7 right = Column7::Zero();
};

System system_of(const SeenDepth& depth, const std::vector<DepthMatch>& matches, std::size_t stride,
                 double reach, const DepthState& state, const Vector3d& center) {
  System system;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i].kind != DepthMatch::Kind::on) continue;
    const SeenDepth::Point& point = depth.points[i * stride];
    const DepthRow row = depth_row(point, matches[i], state, center);
    const double off = row.distance / reach;
    const double weight = point.trust * robust_weight(off * off) / (reach * reach);
    system.normal += weight * row.slope * row.slope.transpose();
    system.right -= weight * row.distance * row.slope;
  }
  return system;
}

double mean_cost(const SeenDepth& depth, const std::vector<DepthMatch>& matches, std::size_t stride,
                 double reach, const DepthState& state, const Vector3d& center) {
  constexpr double kInFront = 1.5;
  double sum = 0, all = 1e-9;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const SeenDepth::Point& point = depth.points[i * stride];
    all += point.trust;
    sum += point.trust *
           (matches[i].kind == DepthMatch::Kind::on
                ? robust_cost(depth_row(point, matches[i], state, center).distance, reach)
            : matches[i].kind == DepthMatch::Kind::in_front ? kInFront
                                                            : 1);
  }
  return sum / all;
}

// No longer than the matches can be trusted. False when nothing holds the pose.
bool step(System& system, const ScalePrior& prior, double radius_mm, DepthState& state) {
  constexpr double kLongest_mm = 8, kLargest_rad = 0.12, kDamped = 1e-4;
  // In units of a millimetre on the surface, of a hundredth for the scale.
  Column7 unit;
  unit << Vector3d::Constant(1 / radius_mm), Vector3d::Ones(), 0.01;
  Normal7 normal = unit.asDiagonal() * system.normal * unit.asDiagonal();
  Column7 right = unit.asDiagonal() * system.right;
  const double expected = unit[6] * unit[6] / (prior.log_sd * prior.log_sd);
  const double most = normal.diagonal().maxCoeff();
  if (!(most > 0)) return false;
  normal.diagonal().array() += kDamped * most;
  normal(6, 6) += expected;
  right[6] += expected * (prior.log_mean - state.log_scale) / unit[6];
  Column7 motion = unit.asDiagonal() * solve_symmetric(normal, right);
  if (!motion.allFinite()) return false;
  const double too_far = std::max(
      {1.0, motion.segment<3>(3).norm() / kLongest_mm, motion.head<3>().norm() / kLargest_rad});
  motion /= too_far;
  state.pose = moved(state.pose, motion.head<6>());
  state.log_scale += motion[6];
  return true;
}

}  // namespace

std::vector<DepthMatch> match_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                                    const DepthState& state, std::size_t stride,
                                    const std::vector<DepthMatch>& before) {
  const RigidTransform world_from_camera = rigid_transform(state.pose, surface.center()).inverse();
  const double scale = std::exp(state.log_scale);
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < depth.points.size(); i += stride) {
    Ray ray;
    ray.origin = world_from_camera.translation;
    ray.direction = world_from_camera.rotation * (scale * depth.points[i].place);
    ray.t_max = 1;
    rays.push_back(ray);
  }
  std::vector<RayHit> hits(rays.size());
  surface.scene().first_hits(rays, hits);
  std::vector<DepthMatch> matches;
  for (std::size_t i = 0; i < rays.size(); ++i)
    matches.push_back(match_point(surface, rays[i].origin, rays[i].origin + rays[i].direction,
                                  world_from_camera.rotation * depth.points[i * stride].normal,
                                  hits[i], before.empty() ? hits[i].face : before[i].nearest_face));
  return matches;
}

DepthRow depth_row(const SeenDepth::Point& point, const DepthMatch& match, const DepthState& state,
                   const Vector3d& center_world_mm) {
  const Eigen::Matrix3d turn = state.pose.camera_from_world.toRotationMatrix();
  const Vector3d normal = turn * match.normal_world;
  const Vector3d place = turn * (match.place_world - center_world_mm) + state.pose.center_camera_mm;
  const Vector3d seen = std::exp(state.log_scale) * point.place;
  const double length = seen.norm();
  DepthRow row;
  row.distance = normal.dot(seen - place) / length;
  row.slope.head<3>() = -(seen - state.pose.center_camera_mm).cross(normal) / length;
  row.slope.segment<3>(3) = -normal / length;
  row.slope[6] = normal.dot(place) / length;
  return row;
}

double depth_noise(const SeenDepth& depth, const std::vector<DepthMatch>& matches,
                   const DepthState& state, const Vector3d& center) {
  // What lies farther off is something else, and would tell of how much there is of that.
  constexpr double kLeast = 0.001, kFarthest = 0.05;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i].kind != DepthMatch::Kind::on) continue;
    const double off = depth_row(depth.points[i], matches[i], state, center).distance;
    if (std::abs(off) < kFarthest) sizes.push_back(std::abs(off));
  }
  return std::max(kLeast, kSigmaOfMedianDeviation * median(std::move(sizes)));
}

double align_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                   const ScalePrior& prior, const AlignOptions& options, DepthState& state) {
  const Vector3d& center = surface.center();
  std::vector<DepthMatch> matches;
  for (int i = 0; i < options.iterations; ++i) {
    const double done = static_cast<double>(i) / std::max(1, options.iterations - 1);
    const double reach =
        options.first_reach * std::pow(options.last_reach / options.first_reach, done);
    matches = match_depth(surface, depth, state, options.stride, matches);
    System system = system_of(depth, matches, options.stride, reach, state, center);
    if (!step(system, prior, surface.radius_mm(), state)) return 2;
  }
  if (!(state.pose.center_camera_mm.z() > 0)) return 2;
  matches = match_depth(surface, depth, state, options.stride, matches);
  return mean_cost(depth, matches, options.stride, options.last_reach, state, center);
}

}  // namespace organbake
