// SPDX-License-Identifier: Apache-2.0
#include "warp/gloss.h"

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
  for (int step = 0; step <= kSteps; ++step) {
    const double share = double(step) / kSteps, cosine = 1 - share * share * (1 - least);
    double sum = 0;
    for (const Lighting::Lobe& lobe : lighting.gloss)
      sum += lobe.strength * std::pow(cosine, lobe.exponent);
    table_[step] = static_cast<float>(sum);
  }
  for (const Lighting::Lamp& lamp : lighting.lamps)
    lamps_.push_back({lamp.toward.cast<float>(), lamp.color.cast<float>()});
}

bool Gloss::may_show(const Eigen::Vector3f& normal, const Eigen::Vector3f& toward_eye) const {
  const float widest = std::acos(least_cosine_) + kLean;
  return std::any_of(lamps_.begin(), lamps_.end(), [&](const Lamp& lamp) {
    const float cosine = normal.dot((lamp.toward + toward_eye).normalized());
    return widest >= 3.14f || cosine > std::cos(widest);
  });
}

}  // namespace organbake
