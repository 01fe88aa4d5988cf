// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Bars of tissue between vertices. Bars between the same two add up to one spring; springs come
// out in the order of their vertices.
class SpringBuilder {
 public:
  SpringBuilder(const TriangleMesh& proxy, double young_modulus_kpa);

  // A bar of constant cross-section: k = E·A/L. Between vertices that coincide there is no spring:
  // it would have no direction. Returns whether the two are apart.
  bool add_bar(std::uint32_t a, std::uint32_t b, double cross_section_mm2);

  std::vector<Spring> springs(const std::vector<double>& mass_kg, double damping_ratio) const;
  // The lowest vertex of the part that each vertex hangs together with.
  std::vector<std::uint32_t> parts() const;
  double least_length_mm() const { return least_length_mm_; }

 private:
  const TriangleMesh& proxy_;
  double modulus_n_per_mm2_;
  double least_length_mm_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> stiffness_n_per_mm_;
};

// Up to three struts from every part to its nearest vertices outside, until the network of the
// vertices with a share of the surface is one.
void tie_loose_parts(const TriangleMesh& proxy, const std::vector<double>& vertex_area_mm2,
                     SpringBuilder& network);
// Struts that keep the body's shape: from every vertex a column of its share of the surface
// (vertex_area_mm2) goes straight in and ends on the corners of the face opposite, by their
// barycentric weights. Where nothing lies opposite (an open or broken proxy), it ends at the
// vertex that lies best in that direction, if any does.
void add_body_struts(const TriangleMesh& proxy, const std::vector<double>& vertex_area_mm2,
                     SpringBuilder& network);

}  // namespace organbake
