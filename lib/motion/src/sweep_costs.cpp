// SPDX-License-Identifier: GPL-3.0-or-later
//
// How unlike the windows are that neighbours show at each depth of a pixel: 1 − NCC (Lewis 1995) of
// the best neighbours. In: a reference, neighbours, and the depths to try. Out: a cost volume.
#include "view_depths.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr float kHidden = 1e4F;  // marks what does not count in a neighbour's pattern
constexpr float kLegible = 100;  // patterns are smaller; interpolated marks are not
constexpr int kStripRows = 24;   // worked on together, so that all stays in the cache
constexpr int kMostBest = 4;     // of the neighbours that are believed at each pixel
// Of the window's pixels, in standard deviations²: patterns weaker than this are noise, alike or
// not.
constexpr float kNoise = 0.04F;
constexpr float kLeastSeen = 0.6F;  // of the window's pattern that a neighbour must see
constexpr float kUnseen = -2;       // in the place of an NCC

// A neighbour's pattern with a border of what does not count: places outside are drawn to it.
struct Target {
  int stride = 0;
  float most_u = 0, most_v = 0;
  std::vector<float> pattern;
  // Pixel of reference pixel (x, y) at inverse depth w: (ray · (x, y, 1) + w · shift) / its third.
  Eigen::Matrix3f ray;
  Eigen::Vector3f shift;
};

Eigen::Matrix3d matrix_of(const Intrinsics& k) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
  m(0, 0) = k.fx, m(1, 1) = k.fy, m(0, 2) = k.cx, m(1, 2) = k.cy;
  return m;
}

Target target_of(const SweepView& reference, const SweepView& view) {
  const int width = view.pattern.width, height = view.pattern.height;
  Target target;
  target.stride = width + 3;
  // Interpolation reads one pixel on.
  target.most_u = static_cast<float>(width + 1), target.most_v = static_cast<float>(height + 1);
  target.pattern.assign(std::size_t(width + 3) * (height + 3), kHidden);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (view.counts.at(x, y))
        target.pattern[std::size_t(y + 1) * target.stride + x + 1] = view.pattern.at(x, y);
  const RigidTransform there_from_here =
      view.camera.camera_from_world * reference.camera.camera_from_world.inverse();
  // From pixel indices to indices in the bordered pattern: half a pixel there and back, one border.
  Eigen::Matrix3d from_index = Eigen::Matrix3d::Identity(), to_index = from_index;
  from_index(0, 2) = from_index(1, 2) = to_index(0, 2) = to_index(1, 2) = 0.5;
  const Eigen::Matrix3d project = to_index * matrix_of(view.camera.intrinsics);
  target.ray = (project * there_from_here.rotation *
                matrix_of(reference.camera.intrinsics).inverse() * from_index)
                   .cast<float>();
  target.shift = (project * there_from_here.translation).cast<float>();
  return target;
}

// The target's pattern where row y of the reference at these inverse depths falls.
void warp_row(const Target& target, int y, const float* __restrict base, float offset, int width,
              float* __restrict out) {
  const float fy = static_cast<float>(y);
  const Eigen::Vector3f start = target.ray.col(1) * fy + target.ray.col(2);
  const float ax = start.x(), ay = start.y(), az = start.z();
  const float dx = target.ray(0, 0), dy = target.ray(1, 0), dz = target.ray(2, 0);
  const float sx = target.shift.x(), sy = target.shift.y(), sz = target.shift.z();
  const float most_u = target.most_u, most_v = target.most_v;
  const float* __restrict pattern = target.pattern.data();
  const int stride = target.stride;
  constexpr float kBehind = 1e-6F;
  for (int x = 0; x < width; ++x) {
    const float fx = static_cast<float>(x), w = base[x] + offset;
    const float z = az + dz * fx + sz * w;
    const float per_z = 1 / (z > kBehind ? z : kBehind);
    float u = (ax + dx * fx + sx * w) * per_z, v = (ay + dy * fx + sy * w) * per_z;
    u = u > 0 ? u : 0;
    u = u < most_u ? u : most_u;
    v = v > 0 ? v : 0;
    v = v < most_v ? v : most_v;
    const int iu = static_cast<int>(u), iv = static_cast<int>(v);
    const float du = u - static_cast<float>(iu), dv = v - static_cast<float>(iv);
    const int at = iv * stride + iu;
    const float top = pattern[at] + du * (pattern[at + 1] - pattern[at]);
    const float bottom =
        pattern[at + stride] + du * (pattern[at + stride + 1] - pattern[at + stride]);
    out[x] = top + dv * (bottom - top);
  }
}

// Sums over 2·radius + 1 neighbours along a row, `wide` with radius of zeros on either side: sums
// of 1, 2, 4 … that the number is made of. What is in `wide` is spoilt.
void sum_along(float* wide, int width, int radius, float* __restrict out) {
  const int all = width + 2 * radius;
  std::fill(out, out + width, 0.F);
  int begin = 0;
  for (int many = 1; many <= 2 * radius + 1; many *= 2) {
    if ((2 * radius + 1) & many) {
      for (int x = 0; x < width; ++x) out[x] += wide[x + begin];
      begin += many;
    }
    for (int x = 0; x + many < all; ++x) wide[x] += wide[x + many];
  }
}

void add_row(const float* __restrict row, int width, float* __restrict sum) {
  for (int x = 0; x < width; ++x) sum[x] += row[x];
}

void take_row(const float* __restrict row, int width, float* __restrict sum) {
  for (int x = 0; x < width; ++x) sum[x] -= row[x];
}

// One thread's work on a strip of rows.
class Strip {
 public:
  Strip(const SweepView& reference, const InverseDepthLabels& labels, int best, int first, int last)
      : reference_(reference),
        labels_(labels),
        best_count_(best),
        first_(first),
        last_(last),
        width_(reference.pattern.width),
        above_(std::max(0, first - radius_)),
        below_(std::min(reference.pattern.height, last + radius_)),
        seen_(width_),
        wide_(static_cast<std::size_t>(width_ + 2 * radius_)),
        products_{Plane(width_, below_ - above_), Plane(width_, below_ - above_),
                  Plane(width_, below_ - above_)},
        sums_{Plane(width_, 1), Plane(width_, 1), Plane(width_, 1)},
        whole_(width_, last - first),
        best_(width_, (last - first) * best_count_),
        row_costs_(static_cast<std::size_t>(width_)) {
    sum_whole();
  }

  void label_costs(const std::vector<Target>& targets, int label, CostVolume& volume) {
    std::fill(best_.values.begin(), best_.values.end(), kUnseen);
    const float offset = labels_.step * static_cast<float>(label);
    for (const Target& target : targets) correlate(target, offset);
    for (int y = first_; y < last_; ++y) store(y, label, volume);
  }

 private:
  // Of the reference's own pattern, squared: how much there is to be seen.
  void sum_whole() {
    Plane squares(width_, below_ - above_);
    for (int y = above_; y < below_; ++y) {
      const float* pattern = &reference_.pattern.values[reference_.pattern.index(0, y)];
      float* wide = cleared_wide();
      for (int x = 0; x < width_; ++x) wide[x] = pattern[x] * pattern[x];
      sum_along(wide_.data(), width_, radius_, &squares.at(0, y - above_));
    }
    for (int y = first_; y < last_; ++y) sum_across(squares, y, &whole_.at(0, y - first_));
  }

  void sum_across(const Plane& rows, int y, float* sum) const {
    std::fill(sum, sum + width_, 0.F);
    for (int j = std::max(above_, y - radius_); j < std::min(below_, y + radius_ + 1); ++j)
      add_row(&rows.at(0, j - above_), width_, sum);
  }

  void correlate(const Target& target, float offset) {
    for (int y = above_; y < below_; ++y) multiply(target, offset, y);
    for (int y = first_; y < last_; ++y) {
      for (int i = 0; i < 3; ++i) {
        if (y == first_) {
          sum_across(products_[i], y, sums_[i].values.data());
        } else {
          step_down(products_[i], y, sums_[i].values.data());
        }
      }
      keep_best(y);
    }
  }

  // From the sum about the row above to that about row y.
  void step_down(const Plane& rows, int y, float* sum) const {
    if (y - radius_ - 1 >= above_) take_row(&rows.at(0, y - radius_ - 1 - above_), width_, sum);
    if (y + radius_ < below_) add_row(&rows.at(0, y + radius_ - above_), width_, sum);
  }

  float* cleared_wide() {
    std::fill(wide_.begin(), wide_.begin() + radius_, 0.F);
    std::fill(wide_.end() - radius_, wide_.end(), 0.F);
    return wide_.data() + radius_;
  }

  void multiply(const Target& target, float offset, int y) {
    const std::size_t at = reference_.pattern.index(0, y);
    warp_row(target, y, &labels_.base.values[at], offset, width_, seen_.data());
    const float* __restrict a = &reference_.pattern.values[at];
    float* __restrict b = seen_.data();
    float* __restrict wide = cleared_wide();
    const int j = y - above_, n = width_;
    for (int x = 0; x < n; ++x) {
      const float seen = std::abs(b[x]) < kLegible ? 1.F : 0.F;
      b[x] = std::abs(b[x]) < kLegible ? b[x] : 0;
      wide[x] = a[x] * a[x] * seen;
    }
    sum_along(wide_.data(), n, radius_, &products_[0].at(0, j));
    cleared_wide();
    for (int x = 0; x < n; ++x) wide[x] = a[x] * b[x];
    sum_along(wide_.data(), n, radius_, &products_[1].at(0, j));
    cleared_wide();
    for (int x = 0; x < n; ++x) wide[x] = a[x] != 0 ? b[x] * b[x] : 0;
    sum_along(wide_.data(), n, radius_, &products_[2].at(0, j));
  }

  // The best NCCs of a pixel, falling, one row of the strip's each.
  void keep_best(int y) {
    const float side = static_cast<float>(2 * radius_ + 1), noise = kNoise * side * side;
    const float *__restrict aa = sums_[0].values.data(), *__restrict ab = sums_[1].values.data(),
                *__restrict bb = sums_[2].values.data(),
                *__restrict all = &whole_.at(0, y - first_);
    float* __restrict ncc = seen_.data();
    for (int x = 0; x < width_; ++x) {
      const float there = bb[x] > 0 ? bb[x] : 0;  // a sum that slid down may end below
      const float value = ab[x] / std::sqrt((std::abs(aa[x]) + noise) * (there + noise));
      ncc[x] = aa[x] >= kLeastSeen * all[x] && aa[x] > 0 ? value : kUnseen;
    }
    for (int i = 0; i < best_count_; ++i) {
      float* __restrict best = &best_.at(0, (y - first_) * best_count_ + i);
      for (int x = 0; x < width_; ++x) {
        const float high = best[x] > ncc[x] ? best[x] : ncc[x];
        ncc[x] = best[x] > ncc[x] ? ncc[x] : best[x];
        best[x] = high;
      }
    }
  }

  void store(int y, int label, CostVolume& volume) {
    const float* rows[kMostBest];
    for (int i = 0; i < best_count_; ++i) rows[i] = &best_.at(0, (y - first_) * best_count_ + i);
    std::uint8_t* to = &volume.costs[std::size_t(y) * width_ * volume.labels + label];
    float* __restrict sum = seen_.data();
    float* __restrict count = row_costs_.data();
    std::fill(sum, sum + width_, 0.F);
    std::fill(count, count + width_, 0.F);
    for (int i = 0; i < best_count_; ++i)
      for (int x = 0; x < width_; ++x) {
        const float value = rows[i][x] > 0 ? rows[i][x] : 0;
        sum[x] += value;
        count[x] += rows[i][x] > kUnseen ? 1.F : 0.F;
      }
    constexpr float kScale = CostVolume::kWorst;
    for (int x = 0; x < width_; ++x) {
      const float mean = sum[x] / (count[x] > 0 ? count[x] : 1);
      sum[x] = kScale * (1 - std::min(mean, 1.F)) + 0.5F;
    }
    for (int x = 0; x < width_; ++x)
      to[std::size_t(x) * volume.labels] = static_cast<std::uint8_t>(sum[x]);
  }

  const SweepView& reference_;
  const InverseDepthLabels& labels_;
  int radius_ = kWindowRadius_px, best_count_, first_, last_, width_, above_, below_;
  std::vector<float> seen_;
  std::vector<float> wide_;  // a row between zeros
  Plane products_[3];        // a², a·b, b² of what both see, summed along rows
  Plane sums_[3];
  Plane whole_, best_;
  std::vector<float> row_costs_;
};

}  // namespace

CostVolume neighbour_costs(const SweepView& reference, const std::vector<SweepView>& neighbours,
                           const InverseDepthLabels& labels) {
  const int width = reference.pattern.width, height = reference.pattern.height;
  CostVolume volume{width, height, labels.count, {}};
  volume.costs.resize(std::size_t(width) * height * labels.count);
  std::vector<Target> targets;
  targets.reserve(neighbours.size());
  for (const SweepView& view : neighbours) targets.push_back(target_of(reference, view));
  const int best = std::min(kMostBest, static_cast<int>(targets.size()));
  const int strips = (height + kStripRows - 1) / kStripRows;
  parallel_for(0, strips, [&](int i) {
    Strip strip(reference, labels, best, i * kStripRows, std::min(height, (i + 1) * kStripRows));
    for (int label = 0; label < labels.count; ++label) strip.label_costs(targets, label, volume);
  });
  return volume;
}

}  // namespace organbake
