// SPDX-License-Identifier: Apache-2.0
#include "light/gloss.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "light/unit_vector.h"

namespace organbake {
namespace {

// Less of a lamp of 1 is not seen: half a level where a picture is darkest.
constexpr double kLeastGloss = 2e-4;

}  // namespace

Gloss::Gloss(const Lighting& lighting) {
  double least = 1;
  for (const Lighting::Lobe& lobe : lighting.gloss) {
    if (lobe.strength > kLeastGloss)
      least = std::min(least, std::pow(kLeastGloss / lobe.strength, 1 / lobe.exponent));
  }
  if (!(least < 1)) return;
  least_cosine_ = static_cast<float>(least);
  inverse_range_ = static_cast<float>(1 / (1 - least));
  least_near_cosine_ =
      std::cos(std::min(std::acos(least_cosine_) + kLean, std::numbers::pi_v<float>));
  for (int step = 0; step <= kSteps; ++step) {
    const double share = double(step) / kSteps, cosine = 1 - share * share * (1 - least);
    double sum = 0;
    for (const Lighting::Lobe& lobe : lighting.gloss)
      sum += lobe.strength * std::pow(cosine, lobe.exponent);
    table_[step] = static_cast<float>(sum);
  }
  table_.back() = 0;  // so that what is not seen needs no branch
  for (const Lighting::Lamp& lamp : lighting.lamps)
    lamps_.push_back({lamp.toward.cast<float>(), lamp.color.cast<float>()});
}

void Gloss::shine(const SkinDirections& normals, const SkinDirections& toward_eye, int count,
                  SkinPlanes<3>& gloss) const {
  for (auto& channel : gloss.of) std::fill_n(channel, count, 0.0f);
  // Where the loop's conditions could hide a load, it would not vectorise.
  const float least_cosine = least_cosine_, inverse_range = inverse_range_;
  for (const Lamp& lamp : lamps_) {
    const float lx = lamp.toward.x(), ly = lamp.toward.y(), lz = lamp.toward.z();
    alignas(32) float place[kSpan], share[kSpan];
    for (int i = 0; i < count; ++i) {
      const float nx = normals.of[0][i], ny = normals.of[1][i], nz = normals.of[2][i];
      const float ex = toward_eye.of[0][i], ey = toward_eye.of[1][i], ez = toward_eye.of[2][i];
      const float inverse = 1 / std::sqrt(ex * ex + ey * ey + ez * ez);
      const float hx = lx + inverse * ex, hy = ly + inverse * ey, hz = lz + inverse * ez;
      const float along = nx * hx + ny * hy + nz * hz, facing = nx * lx + ny * ly + nz * lz;
      const float lengths = (nx * nx + ny * ny + nz * nz) * (hx * hx + hy * hy + hz * hz);
      const float cosine = along / std::sqrt(lengths);
      const bool seen = (cosine > least_cosine) & (along > 0) & (facing > 0);  // not where NaN
      const float range = seen ? (1 - cosine) * inverse_range : 1;
      place[i] = kSteps * std::sqrt(range > 0 ? range : 0);
    }
    for (int i = 0; i < count; ++i) {  // the only part that is not done for eight at once
      const int step = std::min(static_cast<int>(place[i]), kSteps - 1);
      const float low = table_[step], high = table_[step + 1];
      share[i] = low + (place[i] - static_cast<float>(step)) * (high - low);
    }
    for (int c = 0; c < 3; ++c) {
      float* const sum = gloss.of[c];
      const float color = lamp.color[c];
      for (int i = 0; i < count; ++i) sum[i] += share[i] * color;
    }
  }
}

bool Gloss::may_show(const Eigen::Vector3f& normal, const Eigen::Vector3f& toward_eye) const {
  return std::any_of(lamps_.begin(), lamps_.end(), [&](const Lamp& lamp) {
    return ordered_dot(normal, unit_vector(lamp.toward + toward_eye)) >= least_near_cosine_;
  });
}

}  // namespace organbake
