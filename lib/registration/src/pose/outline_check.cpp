// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a photograph confirms the outline: profiles across it, predicted and seen, are correlated
// at shifts either way. A wrong organ of about the right shape correlates well as a whole, but its
// outline lies off in places.
#include "pose/outline_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace organbake {
namespace {

using Eigen::Vector2d;

constexpr int kReach = 10;                // pixels across the outline, either way
constexpr int kHalf = 6;                  // pixels: half the length of what is compared
constexpr int kAlong = 2;                 // pixels averaged along the outline, either way
constexpr int kConfirmed = 1;             // pixels
constexpr double kLeastContrast = 0.004;  // of the luminance range, RMS: below, nothing is there

// Whether an open surface ends there because it was cut.
bool is_cut_near(const Prediction& p, int x, int y) {
  constexpr int kNear = 2;  // pixels
  if (p.border_px.empty()) return false;
  for (int v = y - kNear; v <= y + kNear; ++v)
    for (int u = x - kNear; u <= x + kNear; ++u)
      if (p.contains(u, v) && p.coverage[p.index(u, v)] > 0 &&
          p.border_px[p.index(u, v)] < 2 * kNear)
        return true;
  return false;
}

// Outwards across the outline; zero where the pixel is not on it.
Vector2d outward(const Prediction& p, int x, int y) {
  const auto coverage = [&p](int u, int v) {
    return p.contains(u, v) ? p.coverage[p.index(u, v)] : 0.0f;
  };
  const float here = coverage(x, y);
  if (!(here > 0) || (here == 1 && coverage(x - 1, y) > 0 && coverage(x + 1, y) > 0 &&
                      coverage(x, y - 1) > 0 && coverage(x, y + 1) > 0)) {
    return Vector2d::Zero();
  }
  if (is_cut_near(p, x, y)) return Vector2d::Zero();
  Vector2d slope = Vector2d::Zero();
  for (int v = -2; v <= 2; ++v)
    for (int u = -2; u <= 2; ++u) slope -= coverage(x + u, y + v) * Vector2d(u, v);
  return slope.norm() > 0 ? Vector2d(slope.normalized()) : slope;
}

template <int HalfLength>
using Profile = std::array<double, 2 * HalfLength + 1>;

// Values along the normal, inside first, averaged along the outline. Nothing when any of them is.
template <int HalfLength, class Value>
std::optional<Profile<HalfLength>> profile(const Vector2d& at, const Vector2d& normal,
                                           const Value& value) {
  Profile<HalfLength> values{};
  const Vector2d along(-normal.y(), normal.x());
  for (int i = -HalfLength; i <= HalfLength; ++i)
    for (int s = -kAlong; s <= kAlong; ++s) {
      const Vector2d q = at + i * normal + s * along;
      const std::optional<double> here =
          value(static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())));
      if (!here) return std::nullopt;
      values[i + HalfLength] += *here / (2 * kAlong + 1);
    }
  return values;
}

// Correlation of the predicted profile with the photograph's, `shift` pixels farther out.
double correlation(const Profile<kHalf>& predicted, const Profile<kHalf + kReach>& seen,
                   int shift) {
  constexpr int kCount = 2 * kHalf + 1;
  double mp = 0, ms = 0, ps = 0, pp = 0, ss = 0;
  for (int i = 0; i < kCount; ++i) {
    mp += predicted[i] / kCount;
    ms += seen[i + kReach + shift] / kCount;
  }
  for (int i = 0; i < kCount; ++i) {
    const double p = predicted[i] - mp, s = seen[i + kReach + shift] - ms;
    ps += p * s;
    pp += p * p;
    ss += s * s;
  }
  const double least = kCount * kLeastContrast * kLeastContrast;
  return pp > least && ss > least ? ps / std::sqrt(pp * ss) : -2;
}

struct Match {
  int shift = 0;
  double correlation = -2;
};

Match best_match(const Profile<kHalf>& predicted, const Profile<kHalf + kReach>& seen) {
  Match best;
  for (int distance = 0; distance <= kReach; ++distance)
    for (const int shift : {-distance, distance}) {
      const double value = correlation(predicted, seen, shift);
      if (value > best.correlation) best = {shift, value};
    }
  return best;
}

}  // namespace

OutlineCheck check_outline(const PhotoLevel& level, const Prediction& p, double background) {
  const auto predicted = [&](int x, int y) -> std::optional<double> {
    return p.contains(x, y) ? p.radiance[p.index(x, y)] : background;
  };
  const auto seen = [&](int x, int y) -> std::optional<double> {
    const bool inside =
        x >= 0 && y >= 0 && x < level.intrinsics.width && y < level.intrinsics.height;
    if (!inside || !level.valid[level.index(x, y)]) return std::nullopt;
    return level.luminance[level.index(x, y)];
  };
  OutlineCheck check;
  int confirmed = 0;
  for (int y = p.top; y < p.top + p.height; ++y)
    for (int x = p.left; x < p.left + p.width; ++x) {
      const Vector2d normal = outward(p, x, y);
      if (normal.isZero()) continue;
      ++check.places;
      const Vector2d at(x + 0.5, y + 0.5);
      const auto ours = profile<kHalf>(at, normal, predicted);
      const auto theirs = profile<kHalf + kReach>(at, normal, seen);
      if (!ours || !theirs) continue;
      const Match match = best_match(*ours, *theirs);
      if (match.correlation < -1) continue;
      ++check.asked;
      confirmed += std::abs(match.shift) <= kConfirmed;
    }
  if (check.asked > 0) check.share = static_cast<double>(confirmed) / check.asked;
  return check;
}

}  // namespace organbake
