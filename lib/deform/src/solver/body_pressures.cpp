// SPDX-License-Identifier: Apache-2.0
#include "solver/body_pressures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace organbake::deform {
namespace {

constexpr double kNoSoftness = 1e-300;
// Of a body's size: the volume is linearised about the shape that a step starts from, and a
// pressure that moves its skin farther than this tells nothing of the volume there. Taken at its
// word it may swell the body, be answered by a larger one in the next round, and so on without end.
// What is left is for the next steps.
constexpr double kLinearWithin = 0.5;

}  // namespace

BodyPressures::BodyPressures(const Tissue& tissue, EnclosedVolume volume)
    : tissue_(tissue),
      volume_(std::move(volume)),
      gradient_(tissue.size(), PaddedVector::Zero()),
      response_(tissue.size(), PaddedVector::Zero()),
      pressure_(volume_.bodies().size(), 0.0),
      softness_(pressure_),
      most_pressure_(pressure_),
      volume_gap_(pressure_) {}

void BodyPressures::reset() { std::fill(pressure_.begin(), pressure_.end(), 0.0); }

void BodyPressures::begin_step(const PaddedVectors& x_start) {
  if (pressure_.empty()) return;
  volume_.gradient(x_start, gradient_);
  response_ = gradient_;
  response_due_ = true;
}

void BodyPressures::solve_along(PaddedVector* rows) {
  if (!response_due_) return tissue_.factor().solve_points(rows);
  tissue_.factor().solve_points(rows, response_.data());
  response_due_ = false;
  measure_softness();
}

void BodyPressures::measure_softness() {
  for (std::size_t b = 0; b < softness_.size(); ++b) softness_[b] = volume_.bodies()[b].compliance;
  std::fill(most_pressure_.begin(), most_pressure_.end(), 0.0);
  for (std::uint32_t i = 0; i < tissue_.free_count(); ++i) {
    const std::uint32_t body = volume_.body_of_slot(i);
    if (body == EnclosedVolume::kNoBody) continue;
    softness_[body] += gradient_[i].dot(response_[i]);
    most_pressure_[body] = std::max(most_pressure_[body], response_[i].squaredNorm());
  }
  for (std::size_t b = 0; b < softness_.size(); ++b) {
    const double farthest = std::sqrt(most_pressure_[b]);  // mm per unit of pressure
    const double size_mm = std::cbrt(std::abs(volume_.bodies()[b].rest_mm3));
    most_pressure_[b] =
        farthest > 0 ? kLinearWithin * size_mm / farthest : std::numeric_limits<double>::infinity();
  }
}

bool BodyPressures::acts(std::uint32_t body) const { return softness_[body] > kNoSoftness; }

double BodyPressures::close(std::uint32_t body, double gap_mm3) {
  const double most = most_pressure_[body], before = pressure_[body];
  pressure_[body] = std::clamp(before + gap_mm3 / softness_[body], -most, most);
  return pressure_[body] - before;
}

void BodyPressures::measure_gaps(const PaddedVectors& x_free, const PaddedVectors& x) {
  volume_.measure(x, volumes_);
  for (std::size_t b = 0; b < volumes_.size(); ++b) {
    volume_gap_[b] = volume_.bodies()[b].rest_mm3 - volumes_[b];
  }
  const Double4* gradient = as_double4(gradient_.data());
  const Double4* free = as_double4(x_free.data());
  const Double4* at = as_double4(x.data());
  const auto count = static_cast<std::uint32_t>(tissue_.free_count());
  for (std::uint32_t i = 0; i < count;) {  // by runs of one body
    const std::uint32_t body = volume_.body_of_slot(i);
    Double4 products{};
    for (; i < count && volume_.body_of_slot(i) == body; ++i)
      products += gradient[i] * (free[i] - at[i]);
    if (body != EnclosedVolume::kNoBody)
      volume_gap_[body] -= products[0] + products[1] + products[2];
  }
}

void BodyPressures::move(const PaddedVectors& x_free, PaddedVectors& x) const {
  const Double4* from = as_double4(x_free.data());
  const Double4* swell = as_double4(response_.data());
  Double4* to = as_double4(x.data());
  for (std::uint32_t i = 0; i < tissue_.moving_count(); ++i) {
    const std::uint32_t body = volume_.body_of_slot(i);
    to[i] = body == EnclosedVolume::kNoBody ? from[i] : from[i] + pressure_[body] * swell[i];
  }
}

double BodyPressures::energy() const {
  double twice = 0;
  for (std::size_t b = 0; b < pressure_.size(); ++b) {
    twice += volume_.bodies()[b].compliance * pressure_[b] * pressure_[b];
  }
  return twice / 2;
}

double BodyPressures::volume_error(const PaddedVectors& x) {
  if (pressure_.empty()) return 0;
  volume_.measure(x, volumes_);
  double largest = 0;
  for (std::size_t b = 0; b < volumes_.size(); ++b) {
    const auto& body = volume_.bodies()[b];
    if (body.rest_mm3 == 0 || !acts(static_cast<std::uint32_t>(b))) continue;
    const double error = volumes_[b] + body.compliance * pressure_[b] - body.rest_mm3;
    largest = std::max(largest, std::abs(error / body.rest_mm3));
  }
  return largest;
}

}  // namespace organbake::deform
