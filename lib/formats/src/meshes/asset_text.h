// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "organbake/bundle/tetrahedral_body.h"
#include "organbake/core/text.h"

namespace organbake {

inline constexpr int kAssetMetreDigits = 9;  // a millionth of a millimetre

inline std::string metres_text(const Eigen::Vector3d& v, const char* between) {
  return to_text(v.x(), kAssetMetreDigits) + between + to_text(v.y(), kAssetMetreDigits) + between +
         to_text(v.z(), kAssetMetreDigits);
}

// The items of a list with something between them.
template <class Items, class TextOf>
std::string joined(const Items& items, const char* between, TextOf&& text_of) {
  std::string text;
  bool first = true;
  for (const auto& item : items) {
    if (!first) text += between;
    first = false;
    text += text_of(item);
  }
  return text;
}

// The mass that each node of a solid carries, a quarter of each of its tetrahedra, kg.
inline std::vector<double> node_masses_kg(const TetrahedralBody& body, double density_kg_per_m3) {
  constexpr double kCubicMetres = 1e-9;  // of mm³
  std::vector<double> masses(body.nodes_mm.size(), 0.0);
  for (const Tetrahedron& t : body.tetrahedra)
    for (const std::uint32_t node : t.nodes)
      masses[node] += 0.25 * t.fill * density_kg_per_m3 * kCubicMetres * volume_of(body, t);
  return masses;
}

}  // namespace organbake
