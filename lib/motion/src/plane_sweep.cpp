// SPDX-License-Identifier: GPL-3.0-or-later
//
// Depth of one frame from others whose poses are known: a plane sweep over inverse depth (Collins
// 1996), its costs (sweep_costs.cpp) made smooth by semi-global matching (semi_global.cpp), from
// coarse to fine along the coarser level's surface. In: posed frames. Out: depth, its relative
// standard deviation, and how surely each match is the right one.
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "organbake/core/parallel.h"
#include "organbake/core/smooth_step.h"
#include "organbake/geometry/camera.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/prepared_frame.h"
#include "view_depths.h"

namespace organbake {
PosedFrame posed_frame(const ClipPicture& frame, const Intrinsics& lens, int halvings,
                       const RigidTransform& camera_from_world) {
  StoredPicture picture = frame.picture;
  if (is_combed(picture.color)) deinterlace(picture);
  Intrinsics small = lens;
  for (int i = 0; i < halvings; ++i) {
    picture.color = half_size(picture.color);
    small = half_size(small);
  }
  PosedFrame posed{{"", pinhole_of(small), camera_from_world}, {}, {}};
  // The glow round a highlight moves with it, and would be matched behind the surface.
  constexpr int kGlow = 213;  // of the width one such part
  posed.counts =
      eroded(at_size(frame.usable, small.width, small.height), std::max(1, small.width / kGlow));
  if (small.has_distortion()) {
    picture.color = undistorted(picture.color, small, posed.camera.intrinsics);
    posed.counts = undistorted(posed.counts, small, posed.camera.intrinsics);
  }
  posed.intensity = grey_levels(picture.color);
  return posed;
}

namespace {

constexpr double kLabel_px = 0.5;          // parallax from one depth that is tried to the next
constexpr int kMostLabels = 160;           // of the coarsest level, which tries the whole range
constexpr int kRefiningLabels = 17;        // of each finer level, round what the coarser one found
constexpr float kLeastCorrelation = 0.3F;  // of what is taken for a match at all

struct Level {
  SweepView reference;
  Plane grey;
  std::vector<SweepView> neighbours;
};

SweepView view_of(const PosedFrame& frame) {
  return {frame.camera, local_pattern(frame.intensity, frame.counts), frame.counts};
}

// The finest level first.
std::vector<Level> pyramid(const PosedFrame& reference,
                           const std::vector<const PosedFrame*>& neighbours, int coarsest_px) {
  std::vector<PosedFrame> frames = {reference};
  for (const PosedFrame* frame : neighbours) frames.push_back(*frame);
  std::vector<Level> levels;
  while (true) {
    std::vector<SweepView> views(frames.size());
    parallel_for(std::size_t{0}, frames.size(),
                 [&](std::size_t i) { views[i] = view_of(frames[i]); });
    const Plane& grey = frames[0].intensity;
    levels.push_back({views[0], grey, {views.begin() + 1, views.end()}});
    if (std::max(grey.width, grey.height) <= coarsest_px) return levels;
    for (PosedFrame& frame : frames) {
      halve_counted(frame.intensity, frame.counts);
      frame.camera.intrinsics = half_size(frame.camera.intrinsics);
    }
  }
}

// How far a pixel wanders in the neighbours with inverse depth: pixels per unit, the upper quartile
// of the neighbours, at the middle of the range.
double parallax_px(const Level& level, double inverse_depth) {
  constexpr int kGrid = 5;
  constexpr double kShare = 0.01;
  const Intrinsics& lens = level.reference.camera.intrinsics;
  const RigidTransform world = level.reference.camera.camera_from_world.inverse();
  std::vector<double> of_neighbours;
  for (const SweepView& view : level.neighbours) {
    double sum = 0;
    for (int i = 0; i < kGrid * kGrid; ++i) {
      const Eigen::Vector2d pixel((i % kGrid + 0.5) / kGrid * lens.width,
                                  (i / kGrid + 0.5) / kGrid * lens.height);
      const Eigen::Vector3d ray = unproject(lens, pixel);
      const auto at = [&](double w) {
        return project(view.camera, world * Eigen::Vector3d(ray / w));
      };
      const double change = kShare * inverse_depth;
      sum += (at(inverse_depth + change) - at(inverse_depth)).norm() / change;
    }
    of_neighbours.push_back(sum / (kGrid * kGrid));
  }
  std::sort(of_neighbours.begin(), of_neighbours.end());
  return of_neighbours[3 * (of_neighbours.size() - 1) / 4];
}

// What one level finds.
struct Found {
  Plane inverse_depth;
  Plane correlation;  // 0 where nothing was to be compared
  Plane margin;       // 0…1: by how much other depths are worse
  Plane sd;           // of the inverse depth
};

class LevelSweep {
 public:
  LevelSweep(const Level& level, const InverseDepthLabels& labels)
      : level_(level), labels_(labels) {}

  Found run() {
    const CostVolume volume = neighbour_costs(level_.reference, level_.neighbours, labels_);
    const std::vector<std::uint16_t> sums = aggregated(volume, level_.grey);
    const int width = volume.width, height = volume.height;
    Found found{Plane(width, height), Plane(width, height), Plane(width, height),
                Plane(width, height)};
    parallel_for(0, height, [&](int y) {
      for (int x = 0; x < width; ++x) {
        const std::size_t k = found.sd.index(x, y);
        choose(volume.at(x, y), &sums[k * static_cast<std::size_t>(labels_.count)], k, found);
      }
    });
    return found;
  }

 private:
  // The label of least sum, between its neighbours by a parabola through the costs: the sums, in
  // which steps cost, are drawn to whole labels.
  void choose(const std::uint8_t* costs, const std::uint16_t* sums, std::size_t k,
              Found& found) const {
    const int n = labels_.count;
    const int best = static_cast<int>(std::min_element(sums, sums + n) - sums);
    double label = best;
    if (best > 0 && best + 1 < n) {
      const double before = costs[best - 1], here = costs[best], after = costs[best + 1];
      const double bend = before - 2 * here + after;
      if (bend > 0) label += std::clamp(0.5 * (before - after) / bend, -0.5, 0.5);
    }
    found.inverse_depth.values[k] =
        labels_.base.values[k] + labels_.step * static_cast<float>(label);
    found.correlation.values[k] = 1 - static_cast<float>(costs[best]) / CostVolume::kWorst;
    found.margin.values[k] = margin(sums, best);
    found.sd.values[k] = labels_.step * sd_labels(costs, best);
  }

  float margin(const std::uint16_t* sums, int best) const {
    constexpr int kBeside = 2;
    int other = std::numeric_limits<std::uint16_t>::max();
    for (int i = 0; i < labels_.count; ++i)
      if (std::abs(i - best) > kBeside) other = std::min<int>(other, sums[i]);
    return std::min(1.F, static_cast<float>(other - sums[best]) / kPlain);
  }

  // Of a shift by correlation: (1 − NCC) / (pixels · curvature), pixels that tell anew.
  float sd_labels(const std::uint8_t* costs, int best) const {
    constexpr float kLeastBend = 0.002F;
    const int before = std::max(0, best - 2), after = std::min(labels_.count - 1, best + 2);
    const float scale = 1.F / CostVolume::kWorst;
    const float bend =
        scale * static_cast<float>(costs[before] + costs[after] - 2 * costs[best]) / 4;
    const float rest = std::max(0.02F, scale * static_cast<float>(costs[best]));
    constexpr float side = 2 * kWindowRadius_px + 1;
    constexpr float kAlikePixels = 9;  // that share one noise
    return std::sqrt(rest / (std::max(bend, kLeastBend) * side * side / kAlikePixels));
  }

  static constexpr float kPlain = 150;  // of eight paths' costs: no doubt
  const Level& level_;
  const InverseDepthLabels& labels_;
};

InverseDepthLabels whole_range(const Level& level, const DepthRange& range) {
  const double near = 1 / range.nearest, far = 1 / range.farthest;
  const double wanted = kLabel_px / std::max(1e-12, parallax_px(level, 0.5 * (near + far)));
  const int count =
      std::clamp(static_cast<int>(std::ceil((near - far) / wanted)) + 1, 8, kMostLabels);
  InverseDepthLabels labels;
  labels.base = Plane(level.grey.width, level.grey.height, static_cast<float>(far));
  labels.step = static_cast<float>((near - far) / (count - 1));
  labels.count = count;
  return labels;
}

// Round the coarser level's surface, which is bridged where it is not sure.
InverseDepthLabels round_surface(const Found& coarse, const Level& level, float coarse_step,
                                 const DepthRange& range) {
  Mask sure(coarse.sd.width, coarse.sd.height);
  for (std::size_t k = 0; k < sure.size(); ++k)
    sure.values[k] = coarse.correlation.values[k] >= kLeastCorrelation;
  Plane surface = box_mean(coarse.inverse_depth, sure, 1);
  fill_outside(surface, sure);
  InverseDepthLabels labels;
  labels.step = 0.5F * coarse_step;
  labels.count = kRefiningLabels;
  labels.base = doubled(surface, level.grey.width, level.grey.height);
  const float half = labels.step * static_cast<float>(labels.count / 2);
  const float least = static_cast<float>(0.5 / range.farthest);
  for (float& value : labels.base.values) value = std::max(value - half, least);
  return labels;
}

// Small pieces of depth that hang together with nothing are chance matches: correlation 0.
void drop_speckles(float label_step, Found& found) {
  constexpr double kSmallest = 8e-4;  // share of the picture
  constexpr int kPerLabel = 8, kApart = 12;
  constexpr std::int16_t kNone = -1;
  const int width = found.sd.width, height = found.sd.height;
  cv::Mat steps(height, width, CV_16S);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::size_t k = found.sd.index(x, y);
      const float step = found.inverse_depth.values[k] / label_step * kPerLabel;
      const bool match = found.correlation.values[k] >= kLeastCorrelation && step > 0;
      steps.at<std::int16_t>(y, x) =
          match ? static_cast<std::int16_t>(std::min(step, 32000.F)) : kNone;
    }
  cv::filterSpeckles(steps, kNone, static_cast<int>(kSmallest * width * height), kApart);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (steps.at<std::int16_t>(y, x) == kNone) found.correlation.at(x, y) = 0;
}

SweptDepth result_of(const Found& found, const Level& level) {
  const int width = found.sd.width, height = found.sd.height;
  constexpr float kUnknown = std::numeric_limits<float>::infinity();
  constexpr float kGoodCorrelation = 0.75F;
  SweptDepth result{Plane(width, height, kUnknown), Plane(width, height, kUnknown),
                    Plane(width, height)};
  for (std::size_t k = 0; k < found.sd.size(); ++k) {
    if (!level.reference.counts.values[k]) continue;
    const float correlation = found.correlation.values[k], w = found.inverse_depth.values[k];
    if (correlation < kLeastCorrelation || !(w > 0)) continue;
    result.depth.values[k] = 1 / w;
    result.relative_sd.values[k] = found.sd.values[k] / w;
    result.confidence.values[k] =
        smooth_step<float>(kLeastCorrelation, kGoodCorrelation, correlation) *
        found.margin.values[k];
  }
  return result;
}

}  // namespace

SweptDepth sweep_depth(const PosedFrame& reference,
                       const std::vector<const PosedFrame*>& neighbours, const DepthRange& range,
                       const RunContext& context, int coarsest_px) {
  const std::vector<Level> levels = pyramid(reference, neighbours, coarsest_px);
  InverseDepthLabels labels = whole_range(levels.back(), range);
  for (std::size_t i = levels.size();;) {
    context.throw_if_cancelled();
    const Level& level = levels[--i];
    Found found = LevelSweep(level, labels).run();
    // Before the finer level follows them.
    drop_speckles(labels.step, found);
    if (i == 0) return result_of(found, level);
    labels = round_surface(found, levels[i - 1], labels.step, range);
  }
}

}  // namespace organbake
