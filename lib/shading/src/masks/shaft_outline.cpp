// SPDX-License-Identifier: GPL-3.0-or-later
// A shaft's outline. Each border is the path beside its straight line across which the hue rises
// most in all, found by dynamic programming (Amini, Weymouth & Jain 1990): tips taper, and a line
// through both the shaft and its tip fits neither.
#include "masks/shaft_outline.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "organbake/core/median.h"

namespace organbake {
namespace {

constexpr double kStep = 0.5;            // px between the offsets that are tried
constexpr double kFurthest_px = 12;      // from the straight border
constexpr double kFurthestShare = 0.42;  // the same, of the width: the borders do not meet
constexpr int kMostSteps = 2;            // from one place along the border to the next
constexpr double kBend = 0.03;           // that a step to the side costs, in hue
constexpr double kPull = 5e-4;           // px⁻²: that distance from the straight line costs

// Of the hue between two offsets.
StripMean mean_across(const ShaftView& view, const Shaft& shaft, double t, double from, double to) {
  StripMean mean;
  for (double o = std::min(from, to); o <= std::max(from, to); ++o)
    mean.add(view, view.hue, shaft.at(t, o));
  return mean;
}

// How much the hue rises outward across a border there.
double rise(const ShaftView& view, const Shaft& shaft, int side, double t, double offset) {
  const double outward = side == 0 ? -1 : 1;
  StripMean outside, inside;
  for (int row = -1; row <= 1; ++row)
    for (const double k : {1.0, 2.0}) {
      outside.add(view, view.hue, shaft.at(t + row, offset + outward * k));
      inside.add(view, view.hue, shaft.at(t + row, offset - outward * k));
    }
  if (outside.known < 3 || inside.known < 3) return 0;
  return std::clamp(outside.mean() - inside.mean(), -0.5, 1.0);
}

// One border: its offset at each whole step from the shaft's begin to its end.
class BorderPath {
 public:
  BorderPath(const ShaftView& view, const Shaft& shaft, int side)
      : view_(view),
        shaft_(shaft),
        side_(side),
        places_(1 + static_cast<int>(shaft.to - shaft.from)),
        reach_(static_cast<int>(
            std::min(kFurthest_px, kFurthestShare * shaft.width(0.5 * (shaft.from + shaft.to))) /
            kStep)) {}

  std::vector<double> traced() const {
    const int count = 2 * reach_ + 1;
    std::vector<double> total = gains(0);
    std::vector<std::vector<int>> came_from;
    for (int place = 1; place < places_; ++place) {
      std::vector<double> next = gains(place);
      std::vector<int> from(static_cast<std::size_t>(count));
      for (int k = 0; k < count; ++k) {
        from[k] = k;
        for (int other = std::max(0, k - kMostSteps); other <= std::min(count - 1, k + kMostSteps);
             ++other)
          if (arrived(total, other, k) > arrived(total, from[k], k)) from[k] = other;
        next[k] += arrived(total, from[k], k);
      }
      total = std::move(next);
      came_from.push_back(std::move(from));
    }
    std::vector<double> path(static_cast<std::size_t>(places_));
    int k = static_cast<int>(std::max_element(total.begin(), total.end()) - total.begin());
    for (int place = places_ - 1; place >= 0; --place) {
      path[place] = offset(place, k);
      if (place > 0) k = came_from[place - 1][k];
    }
    return path;
  }

 private:
  const ShaftView& view_;
  const Shaft& shaft_;
  int side_, places_, reach_;

  double offset(int place, int k) const {
    return shaft_.edge(side_, shaft_.from + place) + kStep * (k - reach_);
  }
  std::vector<double> gains(int place) const {
    std::vector<double> all(static_cast<std::size_t>(2 * reach_ + 1));
    for (int k = 0; k <= 2 * reach_; ++k)
      all[k] = rise(view_, shaft_, side_, shaft_.from + place, offset(place, k)) -
               kPull * std::pow(kStep * (k - reach_), 2);
    return all;
  }
  static double arrived(const std::vector<double>& total, int from, int to) {
    return total[from] - kBend * std::abs(from - to);
  }
};

// The first and last place that is nearer to the shaft's own hue than to that beside it: followed
// by one border alone, a shaft is found longer than it is.
std::array<int, 2> ends_of(const ShaftView& view, const Shaft& shaft,
                           const std::array<std::vector<double>, 2>& border) {
  constexpr double kBeside_px = 5;
  std::vector<float> own, beside;
  std::vector<StripMean> inside;
  const int places = static_cast<int>(border[0].size());
  for (int i = 0; i < places; ++i) {
    const double t = shaft.from + i;
    inside.push_back(mean_across(view, shaft, t, border[0][i] + 1, border[1][i] - 1));
    for (int side = 0; side < 2; ++side) {
      const double outward = side == 0 ? -1 : 1;
      const StripMean there = mean_across(view, shaft, t, border[side][i] + outward,
                                          border[side][i] + outward * kBeside_px);
      if (there.known > 0) beside.push_back(static_cast<float>(there.mean()));
    }
    if (inside.back().known > 0) own.push_back(static_cast<float>(inside.back().mean()));
  }
  const double between = 0.5 * (median(std::move(own)) + median(std::move(beside)));
  const auto is_other = [&](int i) { return inside[i].known > 0 && inside[i].mean() > between; };
  std::array<int, 2> ends = {0, places - 1};
  while (ends[0] < ends[1] && is_other(ends[0])) ++ends[0];
  while (ends[0] < ends[1] && is_other(ends[1])) --ends[1];
  return ends;
}

}  // namespace

std::vector<cv::Point2d> trace_outline(const ShaftView& view, const Shaft& shaft) {
  constexpr double kBlur = 0.25;  // px
  std::array<std::vector<double>, 2> border;
  for (int side = 0; side < 2; ++side) border[side] = BorderPath(view, shaft, side).traced();
  const auto [first, last] = ends_of(view, shaft, border);
  if (first >= last) return {};
  std::vector<cv::Point2d> outline;
  for (int i = first; i <= last; ++i)
    outline.push_back(shaft.at(shaft.from + i, border[0][i] - kBlur));
  for (int i = last; i >= first; --i)
    outline.push_back(shaft.at(shaft.from + i, border[1][i] + kBlur));
  return outline;
}

}  // namespace organbake
