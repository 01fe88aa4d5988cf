// SPDX-License-Identifier: GPL-3.0-or-later
#include "vessel_tile.h"

#include <algorithm>
#include <cmath>

#include "organbake/capture/smooth_step.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

using Eigen::Vector2d;

struct Twig {
  Vector2d at;       // not yet brought back onto the square
  int parent;        // −1: a root
  double cubes = 0;  // of widths, of all that it feeds
};

// From one place of the square to the nearest picture of another.
Vector2d shortest(const Vector2d& from, const Vector2d& to, double side) {
  Vector2d way = to - from;
  for (int k = 0; k < 2; ++k) way[k] -= side * std::round(way[k] / side);
  return way;
}

class Growth {
 public:
  explicit Growth(const VesselTreeOptions& options) : o_(options), random_(options.seed) {
    const auto anywhere = [&] {
      const double x = random_.uniform(0, o_.side_mm), y = random_.uniform(0, o_.side_mm);
      return Vector2d(x, y);
    };
    const double per_side = o_.side_mm / o_.spacing_mm;
    const int wanting = static_cast<int>(2.2 * per_side * per_side);
    for (int k = 0; k < wanting; ++k) hungry_.push_back(anywhere());
    for (int k = 0; k < o_.trees; ++k) twigs_.push_back({anywhere(), -1});
  }

  std::vector<Twig> grown() {
    constexpr int kMostRounds = 600;
    for (int round = 0; round < kMostRounds && !hungry_.empty() && grow(); ++round) feed();
    widen();
    return twigs_;
  }

 private:
  // Every hungry point pulls its nearest twig; those that are pulled put out a bud. Whether any
  // did.
  bool grow() {
    const double step = 0.16 * o_.spacing_mm;
    std::vector<Vector2d> pull(twigs_.size(), Vector2d::Zero());
    for (const Vector2d& point : hungry_) {
      const std::size_t nearest = nearest_twig(point);
      pull[nearest] += shortest(twigs_[nearest].at, point, o_.side_mm).normalized();
    }
    const std::size_t count = twigs_.size();
    for (std::size_t t = 0; t < count; ++t) {
      if (!(pull[t].norm() > 1e-6)) continue;
      // Vessels wind a little, and keep some of their way.
      const double turn = random_.uniform(-0.45, 0.45);
      const Vector2d toward = pull[t].normalized() + 0.5 * way_of(t);
      const Vector2d wound = toward + turn * Vector2d(-toward.y(), toward.x());
      twigs_.push_back({twigs_[t].at + step * wound.normalized(), static_cast<int>(t)});
    }
    return twigs_.size() > count;
  }
  Vector2d way_of(std::size_t twig) const {
    const int parent = twigs_[twig].parent;
    return parent < 0 ? Vector2d::Zero() : (twigs_[twig].at - twigs_[parent].at).normalized();
  }
  std::size_t nearest_twig(const Vector2d& point) const {
    std::size_t best = 0;
    double least = 1e300;
    for (std::size_t t = 0; t < twigs_.size(); ++t) {
      const double away = shortest(twigs_[t].at, point, o_.side_mm).squaredNorm();
      if (away < least) least = away, best = t;
    }
    return best;
  }
  void feed() {
    const double reached = 0.4 * o_.spacing_mm;
    std::erase_if(hungry_, [&](const Vector2d& point) {
      return shortest(twigs_[nearest_twig(point)].at, point, o_.side_mm).norm() < reached;
    });
  }
  // Children come after their parents.
  void widen() {
    for (std::size_t t = twigs_.size(); t-- > 0;) {
      Twig& twig = twigs_[t];
      twig.cubes = std::max(twig.cubes, 1.0);
      if (twig.parent >= 0) twigs_[twig.parent].cubes += twig.cubes;
    }
  }

  VesselTreeOptions o_;
  RandomStream random_;
  std::vector<Vector2d> hungry_;
  std::vector<Twig> twigs_;
};

}  // namespace

VesselTile::VesselTile(const VesselTreeOptions& options)
    : pixels_per_mm_(kSide / options.side_mm), cover_(std::size_t(kSide) * kSide, 0.0f) {
  const std::vector<Twig> twigs = Growth(options).grown();
  double most = 1;
  for (const Twig& twig : twigs) most = std::max(most, twig.cubes);
  // The least twig keeps a fifth of the width, whatever Murray's law says.
  const auto width = [&](const Twig& twig) {
    return options.width_mm * std::max(0.2, std::cbrt(twig.cubes / most));
  };
  for (const Twig& twig : twigs) {
    if (twig.parent < 0) continue;
    const Twig& parent = twigs[twig.parent];
    draw(parent.at, twig.at, std::min(width(parent), 1.3 * width(twig)), width(twig));
  }
}

// A piece of a vessel with round ends, on the square and its repetitions.
void VesselTile::draw(const Vector2d& from, const Vector2d& to, double from_width_mm,
                      double to_width_mm) {
  const double reach = 0.5 * std::max(from_width_mm, to_width_mm) + 2 / pixels_per_mm_;
  const Vector2d low = from.cwiseMin(to).array() - reach, high = from.cwiseMax(to).array() + reach;
  const Vector2d along = to - from;
  const double length2 = std::max(along.squaredNorm(), 1e-12);
  const auto pixel = [&](double mm) { return static_cast<int>(std::floor(mm * pixels_per_mm_)); };
  for (int y = pixel(low.y()); y <= pixel(high.y()); ++y)
    for (int x = pixel(low.x()); x <= pixel(high.x()); ++x) {
      const Vector2d at = Vector2d(x + 0.5, y + 0.5) / pixels_per_mm_;
      const double share = std::clamp((at - from).dot(along) / length2, 0.0, 1.0);
      const double half = 0.5 * (from_width_mm + share * (to_width_mm - from_width_mm));
      const double away = (at - from - share * along).norm();
      const double soft = std::max(0.35 * half, 0.7 / pixels_per_mm_);
      const auto cover = static_cast<float>(1 - smooth_step(half - soft, half + soft, away));
      float& kept = cover_[std::size_t(y & (kSide - 1)) * kSide + std::size_t(x & (kSide - 1))];
      kept = std::max(kept, cover);
    }
}

float VesselTile::cover(const Vector2d& place_mm) const {
  const double x = place_mm.x() * pixels_per_mm_ - 0.5, y = place_mm.y() * pixels_per_mm_ - 0.5;
  if (!(std::abs(x) < 1e9 && std::abs(y) < 1e9)) return 0;
  const double x0 = std::floor(x), y0 = std::floor(y);
  const auto at = [&](int i, int j) {
    const int column = (static_cast<int>(x0) + i) & (kSide - 1);
    const int row = (static_cast<int>(y0) + j) & (kSide - 1);
    return cover_[std::size_t(row) * kSide + std::size_t(column)];
  };
  const auto u = static_cast<float>(x - x0), v = static_cast<float>(y - y0);
  return (1 - v) * ((1 - u) * at(0, 0) + u * at(1, 0)) + v * ((1 - u) * at(0, 1) + u * at(1, 1));
}

}  // namespace organbake
