// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "body/tissue.h"
#include "contact/padded_vector.h"

namespace organbake::deform {

// The volume under each closed part of the proxy, kept by a pressure: one scalar constraint
// V(x) + compliance · p = V(rest) per part. A part counts as closed when every edge is used as
// often one way as the other, which clustering proxies keep even where they are not manifold; open
// edges between anchors are allowed, because then V changes alike about any origin.
class EnclosedVolume {
 public:
  static constexpr std::uint32_t kNoBody = 0xFFFFFFFFu;
  struct Body {
    PaddedVector origin = PaddedVector::Zero();  // volumes are measured about it, mm
    double rest_mm3 = 0;
    // mm³ per mN/mm². With volume stiffness s the pressure is s/(1−s) times the bulk modulus of the
    // part's own springs times its volume strain: 1 keeps the volume, 0.5 doubles the resistance.
    double compliance = 0;
  };

  // volume_stiffness: 0 (free) … 1 (kept) of each organ of the tissue.
  EnclosedVolume(const Tissue& tissue, const std::vector<double>& volume_stiffness);

  const std::vector<Body>& bodies() const { return bodies_; }
  std::uint32_t body_of_slot(std::uint32_t slot) const { return body_of_slot_[slot]; }
  // mm³ of each body at x.
  void measure(const PaddedVectors& x, std::vector<double>& volumes_mm3) const;
  // ∂V/∂x of every vertex's own body, mm²; zero outside bodies and on anchors.
  void gradient(const PaddedVectors& x, PaddedVectors& gradient) const;

 private:
  std::vector<std::uint8_t> closed_parts(const Tissue& tissue) const;

  std::vector<Body> bodies_;
  std::vector<std::uint32_t> body_of_slot_;
  struct BodyFace {
    Face slots;
    std::uint32_t body;
  };
  std::vector<BodyFace> faces_;
  std::size_t free_count_ = 0;
};

}  // namespace organbake::deform
