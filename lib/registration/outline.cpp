// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace organbake {
namespace {

using Eigen::Vector2d;

constexpr int kReach = 12;         // pixels across the outline, either way
constexpr int kSide = 3;           // pixels averaged on each side of a supposed edge
constexpr int kConfirmed = 2;      // pixels
constexpr double kAsGood = 0.6;    // of the strongest edge: shading and spots have edges, too
constexpr double kLeastStep = 0.01;  // of the luminance range: below, there is no edge to find

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
  Vector2d slope = Vector2d::Zero();
  for (int v = -2; v <= 2; ++v)
    for (int u = -2; u <= 2; ++u) slope -= coverage(x + u, y + v) * Vector2d(u, v);
  return slope.norm() > 0 ? Vector2d(slope.normalized()) : slope;
}

using Profile = std::array<double, 2 * (kReach + kSide) + 1>;

// Luminance along the normal, inside first; averaged over three pixels along the outline. Nothing
// when part of it does not count.
std::optional<Profile> profile(const PhotoLevel& level, const Vector2d& at, const Vector2d& normal) {
  Profile values{};
  const Vector2d along(-normal.y(), normal.x());
  for (int i = 0; i < static_cast<int>(values.size()); ++i) {
    for (int s = -1; s <= 1; ++s) {
      const Vector2d q = at + (i - kReach - kSide) * normal + s * along;
      const int x = static_cast<int>(std::floor(q.x())), y = static_cast<int>(std::floor(q.y()));
      const Intrinsics& k = level.intrinsics;
      if (x < 0 || y < 0 || x >= k.width || y >= k.height || !level.valid[level.index(x, y)])
        return std::nullopt;
      values[i] += level.luminance[level.index(x, y)] / 3;
    }
  }
  return values;
}

// How much brighter one side is than the other, at an offset along the profile.
double step_at(const Profile& values, int offset) {
  const int middle = offset + kReach + kSide;
  double inside = 0, outside = 0;
  for (int s = 1; s <= kSide; ++s) {
    inside += values[middle - s] / kSide;
    outside += values[middle + s] / kSide;
  }
  return std::abs(inside - outside);
}

struct Steps {
  double here = 0, anywhere = 0;  // within kConfirmed pixels of the outline, and of all
};

Steps find_steps(const Profile& values) {
  Steps steps;
  for (int offset = -kReach; offset <= kReach; ++offset) {
    const double step = step_at(values, offset);
    steps.anywhere = std::max(steps.anywhere, step);
    if (std::abs(offset) <= kConfirmed) steps.here = std::max(steps.here, step);
  }
  return steps;
}

}  // namespace

OutlineCheck check_outline(const PhotoLevel& level, const Prediction& p) {
  OutlineCheck check;
  int confirmed = 0;
  for (int y = p.top; y < p.top + p.height; ++y)
    for (int x = p.left; x < p.left + p.width; ++x) {
      const Vector2d normal = outward(p, x, y);
      if (normal.isZero()) continue;
      const auto values = profile(level, Vector2d(x + 0.5, y + 0.5), normal);
      if (!values) continue;
      const Steps steps = find_steps(*values);
      if (steps.anywhere < kLeastStep) continue;
      ++check.asked;
      confirmed += steps.here > kAsGood * steps.anywhere;
    }
  if (check.asked > 0) check.share = static_cast<double>(confirmed) / check.asked;
  return check;
}

}  // namespace organbake
