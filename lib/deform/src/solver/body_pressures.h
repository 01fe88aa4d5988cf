// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "body/enclosed_volume.h"
#include "body/tissue.h"

namespace organbake::deform {

// The pressures p that keep the volumes of bodies: each pushes its body's skin along ∇V, which
// moves it by A⁻¹∇V p. Softly: V + compliance · p = V(rest).
class BodyPressures {
 public:
  BodyPressures(const Tissue& tissue, EnclosedVolume volume);

  bool none() const { return pressure_.empty(); }
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
