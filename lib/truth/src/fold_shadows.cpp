// SPDX-License-Identifier: Apache-2.0
// Ambient occlusion by the depth beside its own blurred picture (Luft, Colditz and Deussen 2006,
// "Image enhancement by unsharp masking the depth buffer"): a plane, however steep, is its own
// mean, so that nothing but folds and steps darken. Red comes back from the walls of a fold most.
#include "fold_shadows.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "box_blur.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr double kReach_mm = 3;                       // round a place, at the mean depth
constexpr float kDeep_mm = 1.5f;                      // where half of the strength is reached
constexpr float kApart_mm = 8;                        // beyond, two things are no longer near
constexpr std::array<float, 3> kHue = {0.75f, 1, 1};  // of the darkness, RGB

// 0…1, of a place that lies so much deeper than its surroundings.
float occluded(float deeper_mm) {
  if (!(deeper_mm > 0)) return 0;
  const float apart = deeper_mm / kApart_mm;
  return deeper_mm / (deeper_mm + kDeep_mm) / (1 + apart * apart * apart * apart);
}

}  // namespace

void darken_folds(double strength, double focal_px, const std::vector<float>& depth_mm,
                  Rgb8Image& picture) {
  if (!(strength > 0)) return;
  std::vector<float> there(depth_mm.size()), depth(depth_mm.size());
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (!std::isfinite(depth_mm[i])) continue;
    there[i] = 1, depth[i] = depth_mm[i];
    sum += depth_mm[i], ++count;
  }
  if (count == 0) return;
  constexpr int kMost_px = 64;
  const int radius = std::clamp(static_cast<int>(focal_px * kReach_mm * count / sum), 1, kMost_px);
  const std::vector<float> means =
      box_blurred(std::move(depth), picture.width, picture.height, radius);
  const std::vector<float> shares = box_blurred(there, picture.width, picture.height, radius);
  const auto& linear = linear_from_srgb8();
  parallel_for(0, picture.height, [&](int y) {
    for (int x = 0; x < picture.width; ++x) {
      const std::size_t i = std::size_t(y) * picture.width + x;
      if (!std::isfinite(depth_mm[i])) continue;
      const float dark =
          static_cast<float>(strength) * occluded(depth_mm[i] - means[i] / shares[i]);
      if (!(dark > 0.005f)) continue;
      std::uint8_t* const rgb = picture.at(x, y);
      for (int c = 0; c < 3; ++c) rgb[c] = srgb8_from_linear((1 - dark * kHue[c]) * linear[rgb[c]]);
    }
  });
}

}  // namespace organbake
