// SPDX-License-Identifier: GPL-3.0-or-later
// The surface of one label of a mask: the label is blurred by a Gaussian and contoured at the level
// at which the surface encloses the voxels' own volume. One half, the usual level, takes volume
// from whatever is convex. How wide the blur must be, the stairs of the mask tell.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "organbake/contour/contour.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/isosurface/isosurface.h"
#include "organbake/volume/read_volume.h"
#include "surface_steps.h"

namespace organbake {
namespace {

// How coarse the grid was that a mask was drawn on, read off the heights of the steps in its
// surface: a histogram of height differences between neighbouring columns has no entry below that
// grid's spacing.
constexpr int kHighestStep = 8;
// Slopes below 45° alone make more than half of all steps 1 high on a mask's own grid. Stray voxels
// of a resampled mask make a few per cent.
constexpr double kShareOfLowSteps = 0.25;

using StepCounts = std::array<std::size_t, kHighestStep + 1>;

class LabelSteps {
 public:
  LabelSteps(const Volume& mask, int label, const LabelBox& box)
      : size_(box.size), inside_(box.voxels()) {
    with_values(mask, [&](const auto values) {
      parallel_for(0, size_[2], [&](int k) {
        for (int j = 0; j < size_[1]; ++j) {
          const auto* from =
              values.data() +
              (std::size_t(k + box.first[2]) * mask.size[1] + j + box.first[1]) * mask.size[0] +
              box.first[0];
          std::uint8_t* const row = &inside_[place({0, j, k})];
          for (int i = 0; i < size_[0]; ++i) row[i] = from[i] == label;
        }
      });
    });
  }

  int typical_height(int axis) const {
    std::vector<StepCounts> of_slices(static_cast<std::size_t>(size_[2]));
    parallel_for(0, size_[2],
                 [&](int k) { of_slices[static_cast<std::size_t>(k)] = count_steps(axis, k); });
    StepCounts counts{};
    for (const StepCounts& slice : of_slices)
      for (int height = 0; height <= kHighestStep; ++height) counts[height] += slice[height];
    std::size_t steps = 0, low = 0;
    for (int height = 1; height <= kHighestStep; ++height) steps += counts[height];
    for (int height = 1; height <= kHighestStep; ++height) {
      low += counts[height];
      if (static_cast<double>(low) >= kShareOfLowSteps * static_cast<double>(steps) && low > 0)
        return height;
    }
    return 1;  // a box has no steps at all
  }

 private:
  using Index = std::array<int, 3>;

  static Index moved(Index at, int axis, int by) {
    at[axis] += by;
    return at;
  }
  std::size_t place(const Index& at) const {
    return (static_cast<std::size_t>(at[2]) * size_[1] + at[1]) * size_[0] + at[0];
  }
  bool is_label(const Index& at) const {
    for (int axis = 0; axis < 3; ++axis)
      if (at[axis] < 0 || at[axis] >= size_[axis]) return false;
    return inside_[place(at)] != 0;
  }
  StepCounts count_steps(int axis, int k) const {
    StepCounts counts{};
    Index at = {0, 0, k};
    for (at[1] = 0; at[1] < size_[1]; ++at[1]) {
      const std::uint8_t* const row = &inside_[place({0, at[1], k})];
      for (at[0] = 0; at[0] < size_[0]; ++at[0]) {
        if (!row[at[0]] || is_label(moved(at, axis, 1))) continue;
        for (int other = 0; other < 3; ++other)
          if (other != axis) ++counts[step_to(moved(at, other, 1), axis)];
      }
    }
    return counts;
  }
  // Height difference between a column's top and the nearest top of the column beside it, where
  // `next` is at the height of the first; 0 when they are level or there is none near.
  std::size_t step_to(const Index& next, int axis) const {
    const bool up = is_label(next);
    for (int height = 0; height <= kHighestStep; ++height)
      if (is_label(moved(next, axis, up ? height + 1 : -height)) != up)
        return static_cast<std::size_t>(height);
    return 0;
  }

  std::array<int, 3> size_;
  std::vector<std::uint8_t> inside_;  // the label's box, x fastest
};

// How many voxels high the steps of a label's staircase are along each axis: 1 for a mask drawn on
// its own grid; 3 for one drawn at 3 mm and brought onto a grid of 1 mm by nearest neighbour, as
// segmentation networks do, whose stairs are then 3 mm. Read off the steps between neighbouring
// columns: slopes make steps of every height, but only a finer grid has none of 1.
Eigen::Vector3d stair_height_voxels(const Volume& mask, int label, const LabelBox& box) {
  const LabelSteps steps(mask, label, box);
  return {static_cast<double>(steps.typical_height(0)),
          static_cast<double>(steps.typical_height(1)),
          static_cast<double>(steps.typical_height(2))};
}

}  // namespace

namespace {

// Below these the staircase of the voxels shows through the blur. It is the terraces between slices
// that show most, and they are as wide in the plane as the slices are apart, so the highest stairs
// count for all axes. Measured on a sphere of 30 mm: normals 23–31° off without a blur, 3–4° with
// these at 1×1×1, 1×1×3 and 3×3×3 mm (9° at 1×1×3 when every axis has one voxel of its own).
constexpr double kLeastSigmaInStairs = 1.0;
constexpr double kLeastSigmaInHighestStairs = 0.8;
// A kernel wider than this is a slip of units, and would take memory without end.
constexpr double kLargestSigma_voxels = 60;

Eigen::Vector3d sigma_voxels(const Volume& mask, const Eigen::Vector3d& stairs,
                             const IsosurfaceOptions& options) {
  if (options.smooth_mm == 0) return Eigen::Vector3d::Zero();
  if (options.smooth_mm > kLargestSigma_voxels * mask.spacing_mm.minCoeff())
    throw UsageError("smooth_mm is " + to_text(options.smooth_mm) + ", more than " +
                     to_text(kLargestSigma_voxels) + " voxels of this mask (" +
                     to_text(mask.spacing_mm.minCoeff()) + " mm)");
  const Eigen::Vector3d stairs_mm = stairs.cwiseProduct(mask.spacing_mm);
  const double everywhere_mm =
      std::max(options.smooth_mm, kLeastSigmaInHighestStairs * stairs_mm.maxCoeff());
  return (kLeastSigmaInStairs * stairs_mm)
      .cwiseMax(everywhere_mm)
      .cwiseQuotient(mask.spacing_mm)
      .cwiseMin(kLargestSigma_voxels);
}

// Room for the blur to fade to nothing. An open surface ends with the volume.
void grow(LabelBox& box, const std::array<int, 3>& volume_size, const Eigen::Vector3d& sigma,
          bool open) {
  for (int axis = 0; axis < 3; ++axis) {
    const int margin = gaussian_reach(sigma[axis]) + 1;
    int first = box.first[axis] - margin, end = box.first[axis] + box.size[axis] + margin;
    if (open) {
      first = std::max(first, 0);
      end = std::min(end, volume_size[axis]);
    }
    box.first[axis] = first;
    box.size[axis] = end - first;
  }
}

std::vector<float> label_field(const Volume& mask, int label, const LabelBox& box) {
  std::vector<float> field(box.voxels(), 0.0f);
  const int first_i = std::max(0, -box.first[0]);
  const int end_i = std::min(box.size[0], mask.size[0] - box.first[0]);
  with_values(mask, [&](const auto values) {
    parallel_for(0, box.size[2], [&](int k) {
      const int from_k = k + box.first[2];
      if (from_k < 0 || from_k >= mask.size[2]) return;
      for (int j = 0; j < box.size[1]; ++j) {
        const int from_j = j + box.first[1];
        if (from_j < 0 || from_j >= mask.size[1]) continue;
        float* row = &field[(std::size_t(k) * box.size[1] + j) * box.size[0]];
        const auto* from = values.data() +
                           (std::ptrdiff_t(from_k) * mask.size[1] + from_j) * mask.size[0] +
                           box.first[0];
        for (int i = first_i; i < end_i; ++i) row[i] = from[i] == label ? 1.0f : 0.0f;
      }
    });
  });
  return field;
}

TriangleMesh contour_at(const std::vector<float>& field, const LabelBox& box, double level) {
  const auto least = static_cast<float>(least_distance_to_level(box.size));
  const float middle = static_cast<float>(level), above = middle + least, below = middle - least;
  std::vector<float> values(field.size());
  std::transform(field.begin(), field.end(), values.begin(),
                 [&](float v) { return v >= middle ? std::max(v, above) : std::min(v, below); });
  return contour(std::span<const float>(values), box.size, middle);
}

// The surface at the level that encloses the mask's own volume (in voxels). A blur pulls every
// convex part inwards at level 0.5, and a vessel of σ's radius vanishes; the level is what makes up
// for it everywhere at once. The volume falls steadily with the level: bracketed from 0.5 outwards,
// then found by false position (Illinois), in four or five contours in all.
class VolumeMatch {
 public:
  VolumeMatch(const std::vector<float>& field, const LabelBox& box, const RunContext& context)
      : field_(field),
        box_(box),
        context_(context),
        target_(static_cast<double>(box.label_voxels)),
        highest_(*std::max_element(field.begin(), field.end())) {}

  TriangleMesh surface() {
    double low = std::min(0.5, 0.99 * highest_), high = low;
    double low_miss = miss_at(low), high_miss = low_miss;  // miss > 0: too large, level too low
    while (!done_ && low_miss < 0 && low > kLowestLevel) {
      high = low, high_miss = low_miss;
      low_miss = miss_at(low = std::max(kLowestLevel, low - kLevelStep));
    }
    while (!done_ && high_miss > 0 && high < 0.99 * highest_) {
      low = high, low_miss = high_miss;
      high_miss = miss_at(high = std::min(0.99 * highest_, high + kLevelStep));
    }
    for (int step = 0; !done_ && low_miss > 0 && high_miss < 0 && step < kMostSteps; ++step) {
      const double level = (low * high_miss - high * low_miss) / (high_miss - low_miss);
      const double miss = miss_at(level);
      // The end that stays twice counts half, or it would stay for ever.
      if (miss > 0) {
        low = level, low_miss = miss, high_miss /= 2;
      } else {
        high = level, high_miss = miss, low_miss /= 2;
      }
    }
    return std::move(best_);
  }
  // By what share the surface's volume misses the mask's.
  double miss() const { return best_miss_ / target_; }

 private:
  static constexpr double kLowestLevel = 0.02;
  static constexpr double kLevelStep = 0.06;
  static constexpr int kMostSteps = 8;
  static constexpr double kTolerance = 1e-3;  // of the volume; the mask itself is 1 % at best

  double miss_at(double level) {
    context_.throw_if_cancelled();
    TriangleMesh mesh = contour_at(field_, box_, level);
    const double miss = signed_volume(mesh) - target_;
    if (std::abs(miss) < best_miss_) {
      best_miss_ = std::abs(miss);
      best_ = std::move(mesh);
    }
    done_ = best_miss_ <= kTolerance * target_;
    return miss;
  }

  const std::vector<float>& field_;
  const LabelBox& box_;
  const RunContext& context_;
  double target_;
  double highest_;
  TriangleMesh best_;
  double best_miss_ = std::numeric_limits<double>::infinity();
  bool done_ = false;
};

// No level gives a label its volume whose parts are much finer than the blur: specks, or voxels far
// longer than wide.
TriangleMesh matched_surface(const std::vector<float>& field, const LabelBox& box, int label,
                             const RunContext& context) {
  constexpr double kSaid = 0.01, kRefused = 0.1;
  VolumeMatch match(field, box, context);
  TriangleMesh mesh = match.surface();
  if (mesh.empty() || match.miss() <= kSaid) return mesh;
  const std::string what = "label " + std::to_string(label) +
                           " is finer than its smoothing: the surface's volume would be " +
                           percent(match.miss(), 1) + " off the label's; ";
  if (match.miss() > kRefused) throw BadDataError(what + "choose a smaller --smooth-mm, or 0");
  context.warn(what + "a smaller --smooth-mm may help");
  return mesh;
}

}  // namespace

Isosurface extract_label_surface(const Volume& mask, const IsosurfaceOptions& options,
                                 const RunContext& context, const Volume* scan) {
  options.check();
  check_volume(mask, "the mask");
  const std::string whose = name_of_label(mask, options.label) + ": ";
  LabelBox box = bounding_box(mask, options.label);
  if (box.label_voxels == 0) throw_label_absent(mask, options.label);
  const Eigen::Vector3d stairs = stair_height_voxels(mask, options.label, box);
  const Eigen::Vector3d sigma = sigma_voxels(mask, stairs, options);
  context.throw_if_cancelled();
  std::vector<CutSide> sides = label_cut_sides(mask, options.label, box, stairs, scan);
  const bool round = options.cap == SurfaceCap::round, open = options.cap == SurfaceCap::open;
  if (round) {
    raise_domes(sides, static_cast<double>(box.label_voxels) * mask.spacing_mm.prod());
    grow_over_domes(box, mask, sides);
  }
  grow(box, mask.size, sigma, open);
  std::vector<float> field = label_field(mask, options.label, box);
  if (round) fill_domes(field, box, mask, sides);
  gaussian_blur(field, box.size, sigma);
  context.progress(0.4);
  // An open surface has no volume to match. Voxel stairs do: at level 0.5 a voxel of its own is an
  // octahedron of a sixth of its volume.
  TriangleMesh mesh = options.keep_volume && !open
                          ? matched_surface(field, box, options.label, context)
                          : contour_at(field, box, 0.5);
  if (mesh.empty())
    throw BadDataError("label " + std::to_string(options.label) +
                       " vanishes when smoothed; choose a smaller --smooth-mm");
  move_to_world(mesh, mask, Eigen::Vector3d(box.first[0], box.first[1], box.first[2]));
  Isosurface surface = finished(std::move(mesh), options, Cavities::kept, whose, context);
  surface.cut_area_mm2 = tell_cut(sides, options.cap, whose, context);
  return surface;
}

}  // namespace organbake
