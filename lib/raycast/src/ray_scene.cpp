// SPDX-License-Identifier: GPL-3.0-or-later
// Ray queries that are exact to double precision on a search tree in single precision (Embree; Wald
// et al. 2014). Embree is given slightly enlarged faces, so that nothing is missed; what it finds
// is decided again in double among the faces near the hit, which makes edges and vertices
// watertight and the answer independent of the order of search.
#include "organbake/raycast/ray_scene.h"
#include "organbake/raycast/face_queries.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "traced_mesh.h"

namespace organbake {
namespace {

constexpr std::size_t kPacket = 8;

// Hits whose least corner weight is below this are decided among the faces round the edge. Far
// above what float can get wrong, far below what would cost time.
constexpr double kEdgeBand = 1e-4;
// Rounding of a corner weight in double, at grazing incidence too: within it, an edge belongs to
// both of its faces.
constexpr double kWeightRounding = 1e-9;
// How far behind a face that was not hit after all the search goes on (float, scene of size 1…2).
constexpr float kStep = 1e-6f;

// A ray in the scene's frame. Its packet ray has a unit direction and starts where the ray enters
// the mesh's sphere: a float origin far away would cost digits.
struct LocalRay {
  Eigen::Vector3d origin, direction;
  double t_min, t_max;
  float reach;  // the packet ray's end
};

struct Packet {
  alignas(32) int valid[kPacket];
  LocalRay local[kPacket];
  RTCRayHit8 embree;
};

bool fill_lane(const TracedMesh& mesh, const Ray& ray, std::size_t lane, LocalRay& local,
               RTCRay8& packet) {
  local.origin = mesh.scale * (ray.origin - mesh.center);
  local.direction = mesh.scale * ray.direction;
  local.t_min = ray.t_min;
  local.t_max = ray.t_max;
  const double length2 = local.direction.squaredNorm(), length = std::sqrt(length2);
  const double nearest = -local.origin.dot(local.direction) / length2;
  const double half_chord = mesh.radius / length;  // at most: as if through the centre
  const double start = std::max(ray.t_min, nearest - half_chord);
  const double end = std::min(ray.t_max, nearest + half_chord);
  // std::max and std::min may drop a NaN, so each value is asked.
  if (!(start <= end) || !std::isfinite(start) || !std::isfinite(nearest) ||
      !std::isfinite(half_chord) || std::isnan(ray.t_min) || std::isnan(ray.t_max)) {
    return false;
  }
  const Eigen::Vector3f origin = (local.origin + start * local.direction).cast<float>();
  const Eigen::Vector3f direction = (local.direction / length).cast<float>();
  packet.org_x[lane] = origin.x();
  packet.org_y[lane] = origin.y();
  packet.org_z[lane] = origin.z();
  packet.dir_x[lane] = direction.x();
  packet.dir_y[lane] = direction.y();
  packet.dir_z[lane] = direction.z();
  packet.tnear[lane] = 0;
  packet.tfar[lane] = local.reach = static_cast<float>((end - start) * length);
  packet.time[lane] = 0;
  packet.mask[lane] = 0xFFFFFFFFu;
  packet.flags[lane] = 0;
  return true;
}

// Returns false when no lane is to be traced.
bool fill_packet(const TracedMesh& mesh, std::span<const Ray> rays, Packet& packet) {
  bool any = false;
  for (std::size_t k = 0; k < kPacket; ++k) {
    const bool trace =
        k < rays.size() && fill_lane(mesh, rays[k], k, packet.local[k], packet.embree.ray);
    packet.valid[k] = trace ? -1 : 0;
    any |= trace;
  }
  return any;
}

// One bundle: within 25° of the first ray and starting near it. Decided for each packet by itself;
// Embree's two modes differ in speed only (by 2 either way).
bool coherent(const RTCRay8& rays, const int* valid) {
  constexpr float kLeastCosine = 0.9f, kMostDistance2 = 0.1f;
  std::size_t first = 0;
  while (first < kPacket && !valid[first]) ++first;
  for (std::size_t k = first + 1; k < kPacket; ++k) {
    if (!valid[k]) continue;
    const float x = rays.org_x[k] - rays.org_x[first], y = rays.org_y[k] - rays.org_y[first],
                z = rays.org_z[k] - rays.org_z[first];
    const float cosine = rays.dir_x[k] * rays.dir_x[first] + rays.dir_y[k] * rays.dir_y[first] +
                         rays.dir_z[k] * rays.dir_z[first];
    if (cosine < kLeastCosine || x * x + y * y + z * z > kMostDistance2) return false;
  }
  return true;
}

RayHit hit_at(std::uint32_t face, const PlaneCrossing& at) {
  const double u = std::clamp(at.u, 0.0, 1.0), v = std::clamp(at.v, 0.0, 1.0 - u);
  return {face, at.t, static_cast<float>(u), static_cast<float>(v)};
}

bool crosses(const LocalRay& ray, const PlaneCrossing& at) {
  return at.inside_by(-kWeightRounding) && at.t >= ray.t_min && at.t <= ray.t_max;
}

// The first face that the ray meets among those round a face's corners; the lowest index at ties,
// so that the order in which Embree looked does not matter.
RayHit first_around(const TracedMesh& mesh, const LocalRay& ray, std::uint32_t face) {
  RayHit best;
  for (const std::uint32_t corner : mesh.faces[face]) {
    for (const std::uint32_t other : mesh.vertex_faces.of(corner)) {
      const PlaneCrossing at = cross_plane(mesh.corners(other), ray.origin, ray.direction);
      if (!crosses(ray, at)) continue;
      if (at.t < best.t || (at.t == best.t && other < best.face)) best = hit_at(other, at);
    }
  }
  return best;
}

// The next face behind distance `from` along the packet ray; `from` becomes its distance.
std::uint32_t next_face(const TracedMesh& mesh, const Packet& packet, std::size_t lane,
                        float& from) {
  const RTCRay8& rays = packet.embree.ray;
  RTCRayHit ray{};
  ray.ray = {rays.org_x[lane],
             rays.org_y[lane],
             rays.org_z[lane],
             from + kStep,
             rays.dir_x[lane],
             rays.dir_y[lane],
             rays.dir_z[lane],
             0,
             packet.local[lane].reach,
             0xFFFFFFFFu,
             0,
             0};
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  if (!(ray.ray.tnear <= ray.ray.tfar)) return kNoHit;
  intersect(mesh.scene.get(), ray);
  from = ray.ray.tfar;
  return ray.hit.geomID == RTC_INVALID_GEOMETRY_ID ? kNoHit : ray.hit.primID;
}

// From what Embree found among the enlarged faces to what the ray really hits.
RayHit refine(const TracedMesh& mesh, const Packet& packet, std::size_t lane) {
  const LocalRay& ray = packet.local[lane];
  float distance = packet.embree.ray.tfar[lane];
  RayHit best;
  for (std::uint32_t face = packet.embree.hit.primID[lane]; face != kNoHit;
       face = next_face(mesh, packet, lane, distance)) {
    const PlaneCrossing at = cross_plane(mesh.corners(face), ray.origin, ray.direction);
    const bool crossed = crosses(ray, at), interior = crossed && at.inside_by(kEdgeBand);
    const RayHit hit = interior ? hit_at(face, at) : first_around(mesh, ray, face);
    if (hit.t < best.t) best = hit;
    // Only the face's margin was hit: something else may lie behind it and before the best.
    if (crossed) break;
  }
  return best;
}

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
    const FaceCorners corners = mesh.corners(candidate);
    if (surely_farther(corners)) return false;
    const Eigen::Vector3d p = closest_on_face(corners, query);
    const double d2 = (p - query).squaredNorm();
    if (d2 > distance2 || (d2 == distance2 && candidate > face)) return false;
    const bool nearer = d2 < distance2;
    point = p;
    distance2 = d2;
    face = candidate;
    return nearer;
  }
  // By the face's box: most of what shares a leaf of the tree with the nearest face is.
  bool surely_farther(const FaceCorners& face) const {
    constexpr double kRounding = 1 + 1e-9;
    const Eigen::Vector3d low = face.a.cwiseMin(face.b).cwiseMin(face.c),
                          high = face.a.cwiseMax(face.b).cwiseMax(face.c);
    const Eigen::Vector3d off = (low - query).cwiseMax(query - high).cwiseMax(0.0);
    return off.squaredNorm() > kRounding * distance2;
  }
  // Wide enough that float rounding hides no nearer face, nor an equally near one.
  float radius() const {
    const double rounding = kFloatRounding * (4 + query.cwiseAbs().maxCoeff());
    return static_cast<float>(std::sqrt(distance2) + rounding);
  }
};

bool visit_face(RTCPointQueryFunctionArguments* arguments) {
  auto& nearest = *static_cast<Nearest*>(arguments->userPtr);
  if (!nearest.consider(arguments->primID)) return false;
  arguments->query->radius = nearest.radius();
  return true;
}

}  // namespace

struct RayScene::Impl {
  explicit Impl(const TriangleMesh& traced) : mesh(traced) {}
  TracedMesh mesh;
};

RayScene::RayScene(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>(mesh)) {}
RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

void RayScene::first_hits(std::span<const Ray> rays, std::span<RayHit> hits) const {
  if (rays.size() != hits.size()) throw std::invalid_argument("first_hits: one hit per ray");
  const TracedMesh& mesh = impl_->mesh;
  Packet packet;
  for (std::size_t i = 0; i < rays.size(); i += kPacket) {
    const auto batch = rays.subspan(i, std::min(kPacket, rays.size() - i));
    std::fill_n(packet.embree.hit.geomID, kPacket, RTC_INVALID_GEOMETRY_ID);
    if (fill_packet(mesh, batch, packet)) {
      const bool together = coherent(packet.embree.ray, packet.valid);
      intersect(packet.valid, mesh.scene.get(), packet.embree, together);
    }
    for (std::size_t k = 0; k < batch.size(); ++k) {
      const bool hit = packet.embree.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
      hits[i + k] = hit ? refine(mesh, packet, k) : RayHit{};
    }
  }
}

void RayScene::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
  if (rays.size() != occluded.size()) throw std::invalid_argument("occluded: one flag per ray");
  const TracedMesh& mesh = impl_->mesh;
  Packet packet;
  for (std::size_t i = 0; i < rays.size(); i += kPacket) {
    const auto batch = rays.subspan(i, std::min(kPacket, rays.size() - i));
    if (fill_packet(mesh, batch, packet)) {
      const bool together = coherent(packet.embree.ray, packet.valid);
      find_occluded(packet.valid, mesh.scene.get(), packet.embree.ray, together);
    }
    // Embree marks an occluded ray by tfar = −infinity.
    for (std::size_t k = 0; k < batch.size(); ++k) {
      occluded[i + k] = packet.valid[k] && packet.embree.ray.tfar[k] < 0;
    }
  }
}

ClosestPoint RayScene::closest_point(const Eigen::Vector3d& point,
                                     std::uint32_t likely_face) const {
  if (!point.allFinite()) return {};
  const TracedMesh& mesh = impl_->mesh;
  Nearest nearest{.mesh = mesh, .query = mesh.scale * (point - mesh.center)};
  const double distance = nearest.query.norm();
  if (!std::isfinite(distance)) return {};
  if (distance > kFarAway) {
    for (std::uint32_t face = 0; face < mesh.faces.size(); ++face) nearest.consider(face);
  } else {
    const Eigen::Vector3f at = nearest.query.cast<float>();
    if (likely_face != kNoHit) nearest.consider(likely_face);
    RTCPointQuery query{at.x(), at.y(), at.z(), 0, nearest.radius()};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(mesh.scene.get(), &query, &context, visit_face, &nearest);
  }
  return {nearest.face, nearest.point / mesh.scale + mesh.center,
          std::sqrt(nearest.distance2) / mesh.scale};
}

}  // namespace organbake
