// SPDX-License-Identifier: GPL-3.0-or-later
#include "fusion/solve_scale.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/median.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr int kSampledAcross = 20;   // of a view, in each direction
constexpr double kSamePlace = 0.7;   // of the logarithm of the depths; beyond it is another one
constexpr std::size_t kFewest = 30;  // places that two views must have in common

struct ViewPair {
  std::size_t a, b;
};

// Neighbours in the order of the views, and some farther on: those share most, these move most.
std::vector<ViewPair> pairs_of(std::size_t count) {
  std::vector<ViewPair> pairs;
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t step = 1; step < count; step *= 2) {
      if (a + step >= count) continue;
      pairs.push_back({a, a + step});
      pairs.push_back({a + step, a});
    }
  return pairs;
}

// Logarithms of how much farther away view a has what view b shows, too.
std::vector<double> differences(const SmoothView& a, const SmoothView& b) {
  std::vector<double> logs;
  const int step = std::max(1, std::max(a.depth_mm.width, a.depth_mm.height) / kSampledAcross);
  for (int y = step / 2; y < a.depth_mm.height; y += step)
    for (int x = step / 2; x < a.depth_mm.width; x += step) {
      if (!(a.weight.at(x, y) > 0)) continue;
      const SeenSurface seen = seen_at(b, a.point_world_mm(x, y));
      if (!(seen.weight > 0) || !is_same_side(b, seen, a.normal_world(x, y))) continue;
      const double off = std::log(seen.point_z_mm / seen.depth_mm);
      if (std::abs(off) < kSamePlace) logs.push_back(off);
    }
  return logs;
}

class ScaleSearch {
 public:
  ScaleSearch(std::vector<SmoothView>& views, bool each)
      : views_(views), each_(each), pairs_(pairs_of(views.size())), logs_(pairs_.size()) {
    for (const SmoothView& view : views) {
      given_.push_back(view.camera.camera_from_world.translation);
      if (each) depths_.push_back(view.depth_mm);
    }
    log_factor_.assign(views.size(), 0);
  }
  ~ScaleSearch() {
    place(1);
    for (std::size_t i = 0; i < depths_.size(); ++i) views_[i].depth_mm = std::move(depths_[i]);
  }
  ScaleSearch(const ScaleSearch&) = delete;
  ScaleSearch& operator=(const ScaleSearch&) = delete;

  // How far apart the views are with the cameras' places so many times as far apart; 1 where they
  // have nothing in common.
  double apart_at(double place_factor) {
    place(place_factor);
    std::fill(log_factor_.begin(), log_factor_.end(), 0);
    compare();
    constexpr int kRounds = 3;  // a map's scale moves what it is compared with
    for (int round = 0; each_ && round < kRounds; ++round) {
      solve_factors();
      compare();
    }
    std::vector<double> all;
    for (const std::vector<double>& logs : logs_)
      for (const double off : logs) all.push_back(std::abs(off));
    return all.size() < kFewest ? 1 : std::min(1.0, median(std::move(all)));
  }

  std::vector<double> factors() const {
    std::vector<double> factors;
    for (const double log : log_factor_) factors.push_back(std::exp(log));
    return factors;
  }

 private:
  void place(double factor) {
    for (std::size_t i = 0; i < views_.size(); ++i)
      views_[i].camera.camera_from_world.translation = factor * given_[i];
  }

  void compare() {
    if (each_)
      tbb::parallel_for(std::size_t{0}, views_.size(), [&](std::size_t i) {
        const auto factor = static_cast<float>(std::exp(log_factor_[i]));
        for (std::size_t k = 0; k < depths_[i].size(); ++k)
          views_[i].depth_mm.values[k] = factor * depths_[i].values[k];
      });
    tbb::parallel_for(std::size_t{0}, pairs_.size(), [&](std::size_t p) {
      logs_[p] = differences(views_[pairs_[p].a], views_[pairs_[p].b]);
    });
  }

  // The logarithms of the maps' own scales that take the pairs' median differences away, least
  // squares by how much the pairs share; their sum stays 0.
  void solve_factors() {
    const auto count = static_cast<Eigen::Index>(views_.size());
    Eigen::MatrixXd h = Eigen::MatrixXd::Ones(count, count) * 1e-3;
    Eigen::VectorXd g = Eigen::VectorXd::Zero(count);
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      if (logs_[p].size() < kFewest) continue;
      const auto a = static_cast<Eigen::Index>(pairs_[p].a),
                 b = static_cast<Eigen::Index>(pairs_[p].b);
      const auto weight = static_cast<double>(logs_[p].size());
      const double off = median(std::vector<double>(logs_[p]));
      h(a, a) += weight;
      h(b, b) += weight;
      h(a, b) -= weight;
      h(b, a) -= weight;
      g(a) -= weight * off;
      g(b) += weight * off;
    }
    h.diagonal().array() += 1e-6;
    const Eigen::VectorXd step = h.ldlt().solve(g);
    const double mean = step.mean();
    for (Eigen::Index i = 0; i < count; ++i) log_factor_[std::size_t(i)] += step[i] - mean;
  }

  std::vector<SmoothView>& views_;
  bool each_;
  std::vector<ViewPair> pairs_;
  std::vector<std::vector<double>> logs_;  // of each pair
  std::vector<Vector3d> given_;
  std::vector<Plane> depths_;
  std::vector<double> log_factor_;
};

double usual_depth_mm(const std::vector<SmoothView>& views) {
  std::vector<float> depths;
  for (const SmoothView& view : views)
    for (std::size_t k = 0; k < view.depth_mm.size(); k += 97)
      if (view.weight.values[k] > 0) depths.push_back(view.depth_mm.values[k]);
  return depths.empty() ? 0 : double(median(std::move(depths)));
}

// Extent of the cameras' places.
double path_mm(const std::vector<SmoothView>& views) {
  Eigen::AlignedBox3d box;
  for (const SmoothView& view : views) box.extend(view.camera.center_world_mm());
  return box.diagonal().norm();
}

}  // namespace

bool SolvedScale::told() const {
  constexpr double kClearly = 0.8;
  return apart < kClearly * apart_unmoved;
}

SolvedScale solve_scale(std::vector<SmoothView>& views, bool each) {
  const double depth = usual_depth_mm(views), path = path_mm(views);
  SolvedScale solved;
  solved.depth_factor.assign(views.size(), 1);
  if (views.size() < 2 || !(depth > 0) || !(path > 0)) return solved;
  ScaleSearch search(views, each);
  solved.apart_as_given = search.apart_at(1);
  solved.apart_unmoved = search.apart_at(0);
  constexpr double kLeast = 0.02, kMost = 3, kStep = 1.12;
  double best = std::numeric_limits<double>::infinity(), at = 1;
  for (double factor = kLeast * depth / path; factor <= kMost * depth / path; factor *= kStep)
    if (const double apart = search.apart_at(factor); apart < best) best = apart, at = factor;
  // Thirds of the interval round the best.
  double low = at / kStep, high = at * kStep;
  constexpr double kEnough = 1e-4;
  while (high / low > 1 + kEnough) {
    const double third = std::cbrt(high / low), left = low * third, right = high / third;
    if (search.apart_at(left) < search.apart_at(right)) {
      high = right;
    } else {
      low = left;
    }
  }
  solved.place_factor = std::sqrt(low * high);
  solved.apart = search.apart_at(solved.place_factor);
  solved.depth_factor = search.factors();
  return solved;
}

}  // namespace organbake
