// SPDX-License-Identifier: Apache-2.0
#include "unit/deform/bent_tube.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace organbake::test {

BentTube bent_tube(double gap_rad) {
  constexpr int kRings = 25, kAround = 10;
  constexpr double kArc_mm = 30, kTube_mm = 8;
  BentTube tube;
  const auto ring_center = [&](int ring) {
    const double at = gap_rad / 2 + (2 * std::numbers::pi - gap_rad) * ring / (kRings - 1);
    return Eigen::Vector3d(std::cos(at), std::sin(at), 0);
  };
  for (int ring = 0; ring < kRings; ++ring) {
    const Eigen::Vector3d out = ring_center(ring);
    for (int k = 0; k < kAround; ++k) {
      const double turn = 2 * std::numbers::pi * k / kAround;
      tube.mesh.vertices.push_back(
          kArc_mm * out +
          kTube_mm * (std::cos(turn) * out + std::sin(turn) * Eigen::Vector3d::UnitZ()));
    }
  }
  const auto at = [](int ring, int k) {
    return static_cast<std::uint32_t>(ring * kAround + k % kAround);
  };
  auto& faces = tube.mesh.faces;
  for (int ring = 0; ring + 1 < kRings; ++ring) {
    for (int k = 0; k < kAround; ++k) {
      faces.push_back({at(ring, k), at(ring, k + 1), at(ring + 1, k)});
      faces.push_back({at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)});
    }
  }
  for (const int ring : {0, kRings - 1}) {
    const auto middle = static_cast<std::uint32_t>(tube.mesh.vertices.size());
    tube.mesh.vertices.push_back(kArc_mm * ring_center(ring));
    for (int k = 0; k < kAround; ++k) {
      const std::uint32_t p = at(ring, k), q = at(ring, k + 1);
      faces.push_back(ring == 0 ? Face{middle, q, p} : Face{middle, p, q});
    }
  }
  if (signed_volume(tube.mesh) < 0) {
    for (Face& f : faces) std::swap(f[1], f[2]);
  }
  tube.mechanics.mass_kg.assign(tube.mesh.vertices.size(), 1e-4);
  const auto spring = [&](std::uint32_t a, std::uint32_t b) {
    const double length = (tube.mesh.vertices[a] - tube.mesh.vertices[b]).norm();
    tube.mechanics.springs.push_back({a, b, length, 0.1, 5e-5});
  };
  for (const Face& f : faces) {
    for (int k = 0; k < 3; ++k)
      if (f[k] < f[(k + 1) % 3]) spring(f[k], f[(k + 1) % 3]);
  }
  for (int ring = 0; ring + 1 < kRings; ++ring) {
    for (int k = 0; k < kAround; ++k) spring(at(ring, k), at(ring + 1, k + kAround / 2));
  }
  for (int k = 0; k < kAround; ++k) tube.mechanics.anchors.push_back(at(kRings / 2, k));
  tube.mechanics.volume_stiffness = 1;
  return tube;
}

}  // namespace organbake::test
