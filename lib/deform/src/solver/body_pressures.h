// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
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

// The pressures p that keep the volumes of bodies: each pushes its body's skin along ∇V, which
// moves it by A⁻¹∇V p. Softly: V + compliance · p = V(rest).
class BodyPressures {
 public:
  BodyPressures(const Tissue& tissue, EnclosedVolume volume);

  bool none() const { return pressure_.empty(); }
  template <class Self, class Tape>
  static void pass(Self& self, Tape& tape) {
    tape(self.pressure_);
  }
  std::uint32_t count() const { return static_cast<std::uint32_t>(pressure_.size()); }
  void reset();
  // Takes ∇V at the shape a step starts from.
  void begin_step(const PaddedVectors& x_start);
  // Replaces three right sides by A⁻¹ times them. The step's first one solves A⁻¹∇V, too, in little
  // more time.
  void solve_along(PaddedVector* rows);

  std::uint32_t body_of_slot(std::uint32_t slot) const { return volume_.body_of_slot(slot); }
  // Of a slot of a body, mm per unit of the body's pressure.
  const PaddedVector& move_of(std::uint32_t slot) const { return response_[slot]; }
  double pressure(std::uint32_t body) const { return pressure_[body]; }  // mN/mm²
  // A pressure that moves nothing (flat or anchored skin) is left alone.
  bool acts(std::uint32_t body) const;

  // The volumes V(rest) − V(x_free), linearised about x.
  void measure_gaps(const PaddedVectors& x_free, const PaddedVectors& x);
  // What is left of it under the pressure, mm³, without any contact; and the change of the pressure
  // that closes what contacts leave.
  double gap(std::uint32_t body) const {
    return volume_gap_[body] - softness_[body] * pressure_[body];
  }
  double close(std::uint32_t body, double gap_mm3);

  // x_free, moved by the pressures (mm).
  void move(const PaddedVectors& x_free, PaddedVectors& x) const;
  // Largest |V + compliance · p − V(rest)| / V(rest) over the bodies.
  double volume_error(const PaddedVectors& x);
  // What soft pressures hold (µJ): ½ compliance p².
  double energy() const;

 private:
  void measure_softness();

  const Tissue& tissue_;
  EnclosedVolume volume_;
  PaddedVectors gradient_, response_;  // ∇V (mm²) and A⁻¹∇V
  bool response_due_ = false;          // response_ holds ∇V still
  std::vector<double> pressure_;       // one per body
  std::vector<double> softness_;  // ∇Vᵀ A⁻¹ ∇V + compliance, mm³ per unit of pressure
  std::vector<double> most_pressure_;  // that the linearised volume can be asked about
  std::vector<double> volume_gap_;
  std::vector<double> volumes_;
};

}  // namespace organbake::deform
