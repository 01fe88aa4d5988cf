// SPDX-License-Identifier: GPL-3.0-or-later
// The one scale, or one a map, by which depths and poses belong together: tried over the range of
// what can be, then refined with robust weights; and the views brought to one unit by it.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/fusion/fuse_views.h"
#include "organbake/geometry/dense_solve.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr int kSampledAcross = 20;   // of a view, in each direction
constexpr double kSamePlace = 0.7;   // of the logarithm of the depths; beyond it is another one
constexpr std::size_t kFewest = 30;  // places that two views must have in common

struct ViewPair {
  std::size_t a, b;
};

// Of few views all pairs; of many, neighbours in their order, which share most, and some farther
// on, which move most.
std::vector<ViewPair> pairs_of(std::size_t count) {
  constexpr std::size_t kFew = 12;
  std::vector<ViewPair> pairs;
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t step = 1; step < count; step = count <= kFew ? step + 1 : 2 * step) {
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

// What the views say with the cameras' places so many times as far apart.
struct Trial {
  double place_factor = 1;
  std::vector<float> off;  // of each place that two views show, how far apart they have it

  double apart() const { return off.size() < kFewest ? 1 : std::min(1.0, double(median(off))); }
  // How many places agree, by Cauchy's weight: what does not overlap does not, either.
  double agreeing(double usual_off) const {
    double sum = 0;
    for (const float each : off) {
      const double beyond = double(each) / usual_off;
      sum += 1 / (1 + beyond * beyond);
    }
    return sum;
  }
};

class ScaleSearch {
 public:
  ScaleSearch(std::vector<SmoothView>& views, bool each)
      : views_(views), each_(each), pairs_(pairs_of(views.size())), logs_(pairs_.size()) {
    for (const SmoothView& view : views) {
      given_.push_back(view.camera.camera_from_world.translation);
      if (each) depths_.push_back(view.depth_mm);
    }
    start_.assign(views.size(), 0);
    if (each) even_out();
  }
  ~ScaleSearch() {
    place(1);
    for (std::size_t i = 0; i < depths_.size(); ++i) views_[i].depth_mm = std::move(depths_[i]);
  }
  ScaleSearch(const ScaleSearch&) = delete;
  ScaleSearch& operator=(const ScaleSearch&) = delete;

  Trial at(double place_factor) {
    place(place_factor);
    log_factor_ = start_;
    compare();
    constexpr int kRounds = 3;  // a map's scale moves what it is compared with
    for (int round = 0; each_ && round < kRounds; ++round) {
      solve_factors();
      compare();
    }
    Trial trial{place_factor, {}};
    for (const std::vector<double>& logs : logs_)
      for (const double off : logs) trial.off.push_back(static_cast<float>(std::abs(off)));
    return trial;
  }

  // Of the depths, as the last trial found them.
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
      parallel_for(std::size_t{0}, views_.size(), [&](std::size_t i) {
        const auto factor = static_cast<float>(std::exp(log_factor_[i]));
        for (std::size_t k = 0; k < depths_[i].size(); ++k)
          views_[i].depth_mm.values[k] = factor * depths_[i].values[k];
      });
    parallel_for(std::size_t{0}, pairs_.size(), [&](std::size_t p) {
      logs_[p] = differences(views_[pairs_[p].a], views_[pairs_[p].b]);
    });
  }

  // A scope keeps about its distance: each map begins with the usual depth of all.
  void even_out() {
    double sum = 0;
    for (std::size_t i = 0; i < views_.size(); ++i)
      sum += start_[i] = -std::log(std::max(1e-9, usual_depth_mm({&views_[i], 1})));
    for (double& start : start_) start -= sum / static_cast<double>(start_.size());
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
    const Eigen::VectorXd step = solve_symmetric(h, g);
    const double mean = step.mean();
    for (Eigen::Index i = 0; i < count; ++i) log_factor_[std::size_t(i)] += step[i] - mean;
  }

  std::vector<SmoothView>& views_;
  bool each_;
  std::vector<ViewPair> pairs_;
  std::vector<std::vector<double>> logs_;  // of each pair
  std::vector<Vector3d> given_;
  std::vector<Plane> depths_;
  std::vector<double> start_, log_factor_;
};

// Extent of the cameras' places.
double path_mm(const std::vector<SmoothView>& views) {
  Eigen::AlignedBox3d box;
  for (const SmoothView& view : views) box.extend(view.camera.center_world_mm());
  return box.diagonal().norm();
}

// How far apart the views have a place where they agree best, of the trials in which they have much
// in common.
double least_apart(const std::vector<Trial>& trials) {
  std::size_t most = 0;
  for (const Trial& trial : trials) most = std::max(most, trial.off.size());
  double least = 1;
  constexpr std::size_t kInCommon = 10;  // places, as a share of the most
  for (const Trial& trial : trials)
    if (kInCommon * trial.off.size() >= most) least = std::min(least, trial.apart());
  constexpr double kExact = 1e-3;
  return std::max(least, kExact);
}

// Scales in even steps, the best one's surroundings again in thirds.
double best_factor(ScaleSearch& search, double least, double most) {
  constexpr double kStep = 1.1, kEnough = 1e-4;
  std::vector<Trial> trials;
  for (double factor = least; factor <= most; factor *= kStep) trials.push_back(search.at(factor));
  const double usual_off = least_apart(trials);
  const auto best =
      std::max_element(trials.begin(), trials.end(), [&](const Trial& a, const Trial& b) {
        return a.agreeing(usual_off) < b.agreeing(usual_off);
      });
  double low = best->place_factor / kStep, high = best->place_factor * kStep;
  while (high / low > 1 + kEnough) {
    const double third = std::cbrt(high / low), left = low * third, right = high / third;
    if (search.at(left).agreeing(usual_off) > search.at(right).agreeing(usual_off)) {
      high = right;
    } else {
      low = left;
    }
  }
  return std::sqrt(low * high);
}

}  // namespace

bool SolvedScale::told() const {
  constexpr double kClearly = 0.8;
  return apart < kClearly * apart_unmoved;
}

namespace {

// The scale by which the views agree best about the surface: what a place's depth is in the view
// that shows it against what another view, moved by the scaled poses, has there (robust: by
// Cauchy's weight, as many places as can be). Scales are tried over the range in which the path of
// the cameras lies between a fiftieth and eight times the depths, then the best is refined.
// Deterministic. Views that show nothing in common at any of them have apart = 1. The views are
// moved on the way, and come back as they were.
SolvedScale solve_scale(std::vector<SmoothView>& views, bool each) {
  const double depth = usual_depth_mm(views), path = path_mm(views);
  SolvedScale solved;
  solved.depth_factor.assign(views.size(), 1);
  if (views.size() < 2 || !(depth > 0) || !(path > 0)) return solved;
  ScaleSearch search(views, each);
  solved.apart_as_given = search.at(1).apart();
  solved.apart_unmoved = search.at(0).apart();
  constexpr double kLeast = 0.02, kMost = 8;  // all round, a path is four depths
  solved.place_factor = best_factor(search, kLeast * depth / path, kMost * depth / path);
  solved.apart = search.at(solved.place_factor).apart();
  solved.depth_factor = search.factors();
  return solved;
}

// Poses whose unit differs by less are off, not in another unit; and by another one the views must
// agree far better.
constexpr double kOtherUnit = 1.15, kFarBetter = 0.5;
bool are_relative(const std::vector<DepthView>& views) {
  const auto count = std::count_if(views.begin(), views.end(),
                                   [](const DepthView& view) { return view.relative; });
  if (count == 0 || static_cast<std::size_t>(count) == views.size()) return count > 0;
  const auto relative =
      std::find_if(views.begin(), views.end(), [](const DepthView& view) { return view.relative; });
  throw BadDataError(relative->name,
                     "is relative, others of the depth maps are in millimetres; fuse them apart");
}

// 0 without any depth, which smooth_view() tells.
double usual_depth(const DepthView& view) {
  std::vector<float> depths;
  for (const float z : view.depth_mm.values)
    if (std::isfinite(z) && z > 0) depths.push_back(z);
  return double(median(std::move(depths)));
}

// All depths by one factor so that the usual one is kAssumedDepth_mm.
std::vector<SmoothView> smooth_views(const std::vector<DepthView>& views, bool normalised) {
  double factor = 1;
  if (normalised) {
    std::vector<double> usual;
    for (const DepthView& view : views)
      if (const double depth = usual_depth(view); depth > 0) usual.push_back(depth);
    if (!usual.empty()) factor = kAssumedDepth_mm / median(std::move(usual));
  }
  std::vector<SmoothView> smooth(views.size());
  parallel_for(std::size_t{0}, views.size(), [&](std::size_t i) {
    if (factor == 1) {
      smooth[i] = smooth_view(views[i]);
      return;
    }
    DepthView scaled = views[i];
    for (float& z : scaled.depth_mm.values) z *= static_cast<float>(factor);
    smooth[i] = smooth_view(scaled);
  });
  return smooth;
}

void rescale(const FusedScale& scale, std::vector<SmoothView>& views) {
  const double places = scale.solved.place_factor;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double own = scale.solved.depth_factor[i];
    if (own != 1) scale_depth(own, views[i]);
    if (scale.in_poses_unit) {
      scale_depth(1 / places, views[i]);
    } else {
      scale_place(places, views[i]);
    }
  }
}

// Whether each map is of the scale of the others, with the places so many times as far apart.
bool agree(std::vector<SmoothView>& views, double place_factor) {
  std::vector<RigidTransform> given;
  for (SmoothView& view : views) {
    given.push_back(view.camera.camera_from_world);
    scale_place(place_factor, view);
  }
  const std::vector<ViewOverlap> overlaps = measure_overlap(views);
  for (std::size_t i = 0; i < views.size(); ++i) views[i].camera.camera_from_world = given[i];
  return std::all_of(overlaps.begin(), overlaps.end(), [](const ViewOverlap& overlap) {
    return !sees_nothing_in_common(overlap) && !is_of_another_scale(overlap);
  });
}

std::optional<FusedScale> scale_of(std::vector<SmoothView>& views, DepthScale wanted,
                                   bool relative) {
  if (wanted == DepthScale::given || views.size() < 2) return std::nullopt;
  FusedScale scale{.how = wanted == DepthScale::each ? DepthScale::each : DepthScale::one,
                   .relative = relative};
  scale.solved = solve_scale(views, scale.how == DepthScale::each);
  const SolvedScale& solved = scale.solved;
  if (wanted == DepthScale::automatic && !relative) {
    const bool other = std::abs(std::log(solved.place_factor)) > std::log(kOtherUnit);
    if (!other || !solved.told() || solved.apart > kFarBetter * solved.apart_as_given)
      return std::nullopt;
  }
  // Each of `shade`'s relative maps has a unit of its own.
  if (wanted == DepthScale::automatic && relative && !agree(views, solved.place_factor)) {
    scale.how = DepthScale::each;
    scale.solved = solve_scale(views, true);
  }
  const double in_poses_unit = kAssumedDepth_mm / scale.solved.place_factor;
  scale.in_poses_unit = relative && scale.solved.told() && in_poses_unit >= kNearestDepth_mm &&
                        in_poses_unit <= kFarthestDepth_mm;
  return scale;
}

}  // namespace

ScaledViews scaled_views(const std::vector<DepthView>& views, DepthScale scale) {
  const bool relative = are_relative(views) && scale != DepthScale::given;
  ScaledViews result;
  result.views = smooth_views(views, relative);
  result.scale = scale_of(result.views, scale, relative);
  if (result.scale) rescale(*result.scale, result.views);
  return result;
}

}  // namespace organbake
