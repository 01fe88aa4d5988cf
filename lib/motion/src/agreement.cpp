// SPDX-License-Identifier: GPL-3.0-or-later
#include "agreement.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// Shares of the depth by which two frames may differ about one place.
constexpr float kLeastApart = 0.015F, kMostApart = 0.05F;
constexpr float kTold = 0.05F;  // confidence that a partner needs to have a say

// For and against a depth, in partners.
struct Votes {
  float agree = 0, against = 0;
};

void ask(const Eigen::Vector3d& point, float sd, const PosedCamera& camera,
         const SweptDepth& partner, Votes& votes) {
  const Eigen::Vector3d there = camera.camera_from_world * point;
  if (there.z() <= 0) return;
  const Eigen::Vector2d pixel = project(camera.intrinsics, there);
  const Intrinsics& lens = camera.intrinsics;
  if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < lens.width && pixel.y() < lens.height))
    return;
  const std::size_t k =
      partner.depth.index(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
  const float confidence = partner.confidence.values[k];
  if (confidence < kTold) return;
  const float apart = static_cast<float>(there.z()) / partner.depth.values[k] - 1;
  const float may =
      std::clamp(2 * std::hypot(sd, partner.relative_sd.values[k]), kLeastApart, kMostApart);
  // Behind what the partner sees it may be hidden; that all partners say so is a coincidence.
  constexpr float kHidden = 0.3F;
  if (std::abs(apart) <= may) {
    votes.agree += confidence;
  } else {
    votes.against += confidence * (apart < 0 ? 1 : kHidden);
  }
}

Plane agreed_confidence(const std::vector<PosedCamera>& cameras,
                        const std::vector<std::size_t>& partners,
                        const std::vector<SweptDepth>& swept, std::size_t i) {
  const SweptDepth& own = swept[i];
  const RigidTransform world_from_camera = cameras[i].camera_from_world.inverse();
  Plane confidence = own.confidence;
  for (int y = 0; y < confidence.height; ++y)
    for (int x = 0; x < confidence.width; ++x) {
      float& value = confidence.at(x, y);
      if (!(value > 0)) continue;
      const Eigen::Vector3d ray = unproject(cameras[i].intrinsics, {x + 0.5, y + 0.5});
      const Eigen::Vector3d point = world_from_camera * Eigen::Vector3d(ray * own.depth.at(x, y));
      Votes votes;
      for (const std::size_t j : partners)
        ask(point, own.relative_sd.at(x, y), cameras[j], swept[j], votes);
      constexpr float kPrior = 0.5F;  // partners that agree before any is asked
      const float sure = 1 - (1 - value) * std::exp2(-votes.agree);
      value = sure * (votes.agree + kPrior) / (votes.agree + votes.against + kPrior);
    }
  return confidence;
}

}  // namespace

void check_agreement(const std::vector<PosedCamera>& cameras,
                     const std::vector<std::vector<std::size_t>>& partners,
                     std::vector<SweptDepth>& swept) {
  std::vector<Plane> confidences(swept.size());
  parallel_for(std::size_t{0}, swept.size(), [&](std::size_t i) {
    confidences[i] = agreed_confidence(cameras, partners[i], swept, i);
  });
  for (std::size_t i = 0; i < swept.size(); ++i) swept[i].confidence = std::move(confidences[i]);
}

}  // namespace organbake
