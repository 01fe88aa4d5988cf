// SPDX-License-Identifier: GPL-3.0-or-later
// Smoothing without shrinking by alternate umbrella steps of opposite sign (Taubin 1995). The
// little volume that is lost all the same is given back along the normals, because an organ's
// volume is what people measure of it.
#include "taubin.h"

#include <algorithm>
#include <cmath>
#include <vector>
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// Pass band 1/λ + 1/μ = 0.1, as Taubin proposes.
constexpr double kShrink = 0.5;
constexpr double kGrow = -0.526315789;
constexpr double kVolumeTolerance = 1e-4;
constexpr int kMostOffsets = 4;

// The neighbours of every vertex, one after the other.
struct Neighbours {
  std::vector<std::uint32_t> first;  // of vertex v: [first[v], first[v + 1])
  std::vector<std::uint32_t> vertex;
  std::vector<bool> fixed;  // on a boundary
  bool closed = true;
};

// In a closed mesh every neighbour follows the vertex in exactly one face; the successors alone are
// all neighbours. A vertex whose successors and predecessors differ lies on a boundary.
Neighbours neighbours_of(const TriangleMesh& mesh) {
  Neighbours around;
  const std::size_t count = mesh.vertices.size();
  around.first.assign(count + 1, 0);
  around.fixed.assign(count, false);
  for (const Face& face : mesh.faces) {
    for (const std::uint32_t corner : face) ++around.first[corner + 1];
  }
  for (std::size_t v = 0; v < count; ++v) around.first[v + 1] += around.first[v];
  around.vertex.resize(around.first.back());
  std::vector<std::uint32_t> at(around.first.begin(), around.first.end() - 1);
  std::vector<std::uint64_t> balance(count, 0);  // successors − predecessors, as a sum of hashes
  const auto hash = [](std::uint64_t x) { return (x + 1) * 0x9E3779B97F4A7C15u; };
  for (const Face& face : mesh.faces) {
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t here = face[c], next = face[(c + 1) % 3], last = face[(c + 2) % 3];
      around.vertex[at[here]++] = next;
      balance[here] += hash(next) - hash(last);
    }
  }
  for (std::size_t v = 0; v < count; ++v) {
    if (balance[v] == 0) continue;
    around.fixed[v] = true;
    around.closed = false;
  }
  return around;
}

void umbrella_step(const std::vector<Eigen::Vector3d>& from, const Neighbours& around, double share,
                   std::vector<Eigen::Vector3d>& to) {
  parallel_for(std::size_t{0}, from.size(), [&](std::size_t v) {
    const std::uint32_t begin = around.first[v], end = around.first[v + 1];
    to[v] = from[v];
    if (begin == end || around.fixed[v]) return;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::uint32_t n = begin; n < end; ++n) sum += from[around.vertex[n]];
    to[v] += share * (sum / (end - begin) - from[v]);
  });
}

// Moving every vertex along its normal by d changes the volume by d times the area.
void give_volume_back(TriangleMesh& mesh, double volume) {
  for (int step = 0; step < kMostOffsets; ++step) {
    const double missing = volume - signed_volume(mesh);
    if (std::abs(missing) <= kVolumeTolerance * std::abs(volume)) return;
    const double offset = missing / surface_area(mesh);
    const std::vector<Eigen::Vector3d> normals = vertex_normals(mesh);
    for (std::size_t v = 0; v < normals.size(); ++v) mesh.vertices[v] += offset * normals[v];
  }
}

}  // namespace

void taubin_smooth(TriangleMesh& mesh, int steps, const RunContext& context) {
  if (steps <= 0 || mesh.empty()) return;
  const Neighbours around = neighbours_of(mesh);
  const double volume = signed_volume(mesh);
  std::vector<Eigen::Vector3d> other(mesh.vertices.size());
  for (int step = 0; step < steps; ++step) {
    context.throw_if_cancelled();
    umbrella_step(mesh.vertices, around, kShrink, other);
    umbrella_step(other, around, kGrow, mesh.vertices);
  }
  if (around.closed) give_volume_back(mesh, volume);
}

}  // namespace organbake
