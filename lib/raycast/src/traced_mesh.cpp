// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh in the frame of a scene, its search tree, and single faces: rays and closest points
// against them in double precision, for what the tree found in single precision.
#include "traced_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"

namespace organbake {
namespace {

Eigen::Vector3d closest_on_segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                   const Eigen::Vector3d& point) {
  const Eigen::Vector3d edge = b - a;
  const double length2 = edge.squaredNorm();
  if (!(length2 > 0)) return a;
  return a + std::clamp(edge.dot(point - a) / length2, 0.0, 1.0) * edge;
}

Eigen::Vector3d closest_on_outline(const FaceCorners& face, const Eigen::Vector3d& point) {
  const Eigen::Vector3d candidates[3] = {closest_on_segment(face.a, face.b, point),
                                         closest_on_segment(face.b, face.c, point),
                                         closest_on_segment(face.c, face.a, point)};
  return *std::min_element(std::begin(candidates), std::end(candidates),
                           [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
                             return (p - point).squaredNorm() < (q - point).squaredNorm();
                           });
}

}  // namespace

FaceCorners enlarged(const FaceCorners& face, double margin) {
  const double la = (face.c - face.b).norm(), lb = (face.a - face.c).norm(),
               lc = (face.b - face.a).norm(), perimeter = la + lb + lc;
  const double double_area = (face.b - face.a).cross(face.c - face.a).norm();
  if (!(double_area > 0)) return face;
  const double growth = std::min(0.5, margin * perimeter / double_area);  // margin over inradius
  const Eigen::Vector3d incenter = (la * face.a + lb * face.b + lc * face.c) / perimeter;
  const auto moved = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return p + growth * (p - incenter);
  };
  return {moved(face.a), moved(face.b), moved(face.c)};
}

Eigen::Vector3d closest_on_face(const FaceCorners& face, const Eigen::Vector3d& point) {
  const Eigen::Vector3d ab = face.b - face.a, ac = face.c - face.a, ap = point - face.a;
  const double ab_ap = ab.dot(ap), ac_ap = ac.dot(ap);
  const double ab_ab = ab.squaredNorm(), ac_ac = ac.squaredNorm(), ab_ac = ab.dot(ac);
  // Weights of the projection onto the plane, times the squared double area.
  const double area2 = ab_ab * ac_ac - ab_ac * ab_ac;
  const double b = ac_ac * ab_ap - ab_ac * ac_ap;
  const double c = ab_ab * ac_ap - ab_ac * ab_ap;
  const double a = area2 - b - c;
  // Needles, whose weights are rounding noise, go to their outline, which is right for them too.
  constexpr double kLeastSine2 = 1e-12;
  if (!(area2 > kLeastSine2 * ab_ab * ac_ac)) return closest_on_outline(face, point);
  if (a >= 0 && b >= 0 && c >= 0) return face.a + (b / area2) * ab + (c / area2) * ac;
  // Outside: on an edge that the projection lies beyond; beyond two, on either.
  const bool beyond[3] = {c < 0, a < 0, b < 0};  // of edges ab, bc, ca
  const Eigen::Vector3d* corner[4] = {&face.a, &face.b, &face.c, &face.a};
  Eigen::Vector3d best = face.a;
  double best2 = std::numeric_limits<double>::infinity();
  for (int edge = 0; edge < 3; ++edge) {
    if (!beyond[edge]) continue;
    const Eigen::Vector3d p = closest_on_segment(*corner[edge], *corner[edge + 1], point);
    const double distance2 = (p - point).squaredNorm();
    if (distance2 < best2) {
      best = p;
      best2 = distance2;
    }
  }
  return best;
}

namespace {

// AVX2 is the project's floor. Pinned, so that machines with AVX-512 take the same path through
// the same tree (it would be about a fifth faster there).
constexpr const char* kDeviceConfig = "isa=avx2";

// Embree is given faces that reach this far over their edges (scene of half-size 1…2): several
// times what float can get wrong. Its own robust mode is tight at edges but not at vertices; with
// the margin nothing is missed, and what is hit too much is sorted out in double.
constexpr double kMargin = 4e-6;

[[noreturn]] void throw_embree_error(RTCError code, const std::string& step) {
  if (code == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw std::runtime_error("Embree failed to " + step + " (error " +
                           std::to_string(static_cast<int>(code)) + ")");
}

struct ReleaseGeometry {
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using Geometry = std::unique_ptr<RTCGeometryTy, ReleaseGeometry>;

// Before anything is derived from its indices.
const TriangleMesh& checked(const TriangleMesh& mesh) {
  if (mesh.empty()) throw BadDataError("mesh to trace: it has no faces");
  check_mesh(mesh, "mesh to trace");
  return mesh;
}

}  // namespace

void ReleaseDevice::operator()(RTCDevice device) const { rtcReleaseDevice(device); }
void ReleaseScene::operator()(RTCScene scene) const { rtcReleaseScene(scene); }

TracedMesh::TracedMesh(const TriangleMesh& mesh)
    : faces(checked(mesh).faces), vertex_faces(mesh.faces, mesh.vertices.size()) {
  place(mesh);
  build();
}

void TracedMesh::place(const TriangleMesh& mesh) {
  // Unused vertices may lie anywhere; only what faces use counts.
  Bounds used;
  for (const Face& face : faces) {
    for (const std::uint32_t vertex : face) used.add(mesh.vertices[vertex]);
  }
  const double half_size = 0.5 * used.diagonal();
  if (!std::isfinite(half_size)) {
    throw BadDataError("mesh to trace: its extent overflows; check the units of its coordinates");
  }
  center = used.center();
  scale = half_size > 1e-150 ? std::scalbn(1.0, -std::ilogb(half_size)) : 1.0;
  radius = half_size * scale * 1.001 + 1e-3;  // a little free space before the first hit
  vertices.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    vertices.push_back(scale * (vertex - center));
  }
}

void TracedMesh::build() {
  device.reset(rtcNewDevice(kDeviceConfig));
  if (!device) throw_embree_error(rtcGetDeviceError(nullptr), "start");
  scene.reset(rtcNewScene(device.get()));
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);

  const Geometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
  float* const points = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                              3 * sizeof(float), 3 * faces.size()));
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Face), faces.size()));
  if (!points || !indices) throw_embree_error(rtcGetDeviceError(device.get()), "take memory");
  constexpr std::size_t kGrain = 4096;
  parallel_pieces(std::size_t{0}, faces.size(), kGrain, [&](std::size_t first, std::size_t last) {
    float* at = points + 9 * first;
    for (std::size_t face = first; face < last; ++face) {
      const FaceCorners large = enlarged(corners(static_cast<std::uint32_t>(face)), kMargin);
      for (const Eigen::Vector3d* corner : {&large.a, &large.b, &large.c})
        for (int axis = 0; axis < 3; ++axis) *at++ = static_cast<float>((*corner)[axis]);
    }
  });
  std::iota(indices, indices + 3 * faces.size(), 0u);
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometry(scene.get(), geometry.get());
  rtcCommitScene(scene.get());
  const RTCError code = rtcGetDeviceError(device.get());
  if (code != RTC_ERROR_NONE) throw_embree_error(code, "build the scene");
}

}  // namespace organbake
