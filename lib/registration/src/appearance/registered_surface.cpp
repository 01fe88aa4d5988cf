// SPDX-License-Identifier: GPL-3.0-or-later
// What registration needs of a surface once: its search tree, smooth normals, evenly spread points,
// and for a piece of an organ how far each place lies from where it was cut.
#include "organbake/registration/registered_surface.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>

#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kSamples = 4000;
constexpr std::uint64_t kSampleSeed = 20040901;

TriangleMesh checked(TriangleMesh mesh) {
  check_mesh(mesh, "surface");
  return mesh;
}

// The lowest vertex at the same place, for each vertex.
std::vector<std::uint32_t> welded(const std::vector<Eigen::Vector3d>& vertices) {
  std::vector<std::uint32_t> order(vertices.size()), first(vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    const auto &p = vertices[a], &q = vertices[b];
    return std::tie(p.x(), p.y(), p.z(), a) < std::tie(q.x(), q.y(), q.z(), b);
  };
  std::sort(order.begin(), order.end(), before);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && vertices[order[i]] == vertices[order[i - 1]];
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  return first;
}

}  // namespace

RegisteredSurface::RegisteredSurface(TriangleMesh mesh, MeshBorders borders)
    : mesh_(checked(std::move(mesh))),
      scene_(mesh_),
      normals_(vertex_normals(mesh_)),
      box_(bounds(mesh_)),
      center_(box_.center()) {
  face_normals_.reserve(mesh_.faces.size());
  for (const auto& [a, b, c] : mesh_.faces) {
    const Vector3d& corner = mesh_.vertices[a];
    face_normals_.push_back((mesh_.vertices[b] - corner).cross(mesh_.vertices[c] - corner));
  }
  for (const Face& face : mesh_.faces)
    for (const std::uint32_t v : face)
      radius_ = std::max(radius_, (mesh_.vertices[v] - center_).norm());
  if (borders == MeshBorders::unknown_beyond)
    border_distance_mm_ = organbake::border_distance_mm(mesh_);
  const AreaSampler places(mesh_, kSamples, kSampleSeed);
  for (std::size_t i = 0; i < kSamples; ++i) {
    const auto [face, weights, point] = places.at(i);
    RayHit hit;
    hit.face = face;
    hit.u = static_cast<float>(weights[1]);
    hit.v = static_cast<float>(weights[2]);
    samples_.push_back({point, skin(hit, -face_normals_[face]).normal});
  }
}

double RegisteredSurface::mean_distance_mm(const RigidTransform& a, const RigidTransform& b) const {
  double sum = 0;
  for (const SurfaceSample& sample : samples_) sum += (a * sample.point - b * sample.point).norm();
  return sum / kSamples;
}

float RegisteredSurface::border_distance_mm(const RayHit& hit) const {
  if (!open()) return std::numeric_limits<float>::infinity();
  const auto& [a, b, c] = mesh_.faces[hit.face];
  const auto& d = border_distance_mm_;
  return (1 - hit.u - hit.v) * d[a] + hit.u * d[b] + hit.v * d[c];
}

RegisteredSurface::Skin RegisteredSurface::skin(const RayHit& hit,
                                                const Vector3d& direction) const {
  const auto& [a, b, c] = mesh_.faces[hit.face];
  const double u = hit.u, v = hit.v, w = 1 - u - v;
  Skin skin{w * normals_[a] + u * normals_[b] + v * normals_[c]};
  const double length = skin.normal.norm();
  skin.normal = length > 0 ? Vector3d(skin.normal / length) : Vector3d(-direction.normalized());
  // Pieces that are inside out, and open sheets from behind, are lit on the side that is seen.
  if (face_normals_[hit.face].dot(direction) > 0) skin.normal = -skin.normal;
  if (!mesh_.colors.empty()) {
    const Eigen::Vector3f luma(0.2126f, 0.7152f, 0.0722f);
    skin.albedo = luma.dot(static_cast<float>(w) * mesh_.colors[a] + hit.u * mesh_.colors[b] +
                           hit.v * mesh_.colors[c]);
  }
  return skin;
}

std::vector<float> border_distance_mm(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> vertex = welded(mesh.vertices);
  std::vector<Face> faces = mesh.faces;
  for (Face& face : faces)
    for (std::uint32_t& v : face) v = vertex[v];
  constexpr float kFar = std::numeric_limits<float>::infinity();
  std::vector<float> distance(mesh.vertices.size(), kFar);
  using Reached = std::pair<float, std::uint32_t>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
  MeshEdges(faces, vertex.size()).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() > 1) return;
    for (const std::uint32_t v : {uses[0].low, uses[0].high})
      if (distance[v] > 0) open.emplace(distance[v] = 0, v);
  });
  if (open.empty()) return {};
  const VertexNeighbours neighbours(faces, vertex.size());
  while (!open.empty()) {
    const auto [reached, v] = open.top();
    open.pop();
    if (reached > distance[v]) continue;
    for (const std::uint32_t w : neighbours.of(v)) {
      const auto length = static_cast<float>((mesh.vertices[v] - mesh.vertices[w]).norm());
      if (reached + length < distance[w]) open.emplace(distance[w] = reached + length, w);
    }
  }
  for (std::size_t v = 0; v < vertex.size(); ++v) distance[v] = distance[vertex[v]];
  return distance;
}

}  // namespace organbake
