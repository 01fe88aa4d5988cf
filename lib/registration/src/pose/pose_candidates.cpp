// SPDX-License-Identifier: GPL-3.0-or-later
// Poses to try: directions spread over the sphere times rolls. Where the organ stands out from a
// plain background, its area and centre fix distance and place, which leaves three of six
// dimensions to search.
#include "pose/poses.h"

#include <cmath>
#include <numbers>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/geometry/dense_solve.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Directions spread evenly over the sphere (a golden-angle spiral).
std::vector<Vector3d> directions(int count) {
  std::vector<Vector3d> all;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2.0 * i + 1) / count, r = std::sqrt(1 - z * z);
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    all.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return all;
}

// Seen from `direction` (object → camera), in some roll.
Quaterniond facing(const Vector3d& direction) {
  return Quaterniond(look_at(direction, Vector3d::Zero(), Vector3d::UnitZ()).rotation);
}

std::vector<float> border_values(const PhotoLevel& level) {
  std::vector<float> values;
  const int w = level.intrinsics.width, h = level.intrinsics.height;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const bool border = x == 0 || y == 0 || x == w - 1 || y == h - 1;
      if (border && level.valid[level.index(x, y)])
        values.push_back(level.luminance[level.index(x, y)]);
    }
  return values;
}

// Nothing when the border is not plain, or next to nothing or nearly all stands out from it.
std::optional<Foreground> find_foreground(const PhotoLevel& level) {
  constexpr float kOutstanding = 6, kLeast = 0.015f;
  constexpr float kPlain = 0.05f;  // spread of a plain border, of the luminance range
  constexpr double kFewest = 0.01, kMost = 0.85;  // of the picture
  std::vector<float> border = border_values(level);
  if (border.size() < 16) return std::nullopt;
  const float background = median(border);
  for (float& value : border) value = std::abs(value - background);
  const float spread = static_cast<float>(kSigmaOfMedianDeviation) * median(border);
  if (spread > kPlain) return std::nullopt;
  const float threshold = std::max(kLeast, kOutstanding * spread);
  Foreground found;
  for (int y = 0; y < level.intrinsics.height; ++y)
    for (int x = 0; x < level.intrinsics.width; ++x) {
      // A blown pixel inside the organ is part of it all the same.
      const std::size_t i = level.index(x, y);
      if (level.valid[i] && std::abs(level.luminance[i] - background) < threshold) continue;
      found.area_px += 1;
      found.center_px += Eigen::Vector2d(x + 0.5, y + 0.5);
    }
  const double share = found.area_px / static_cast<double>(level.luminance.size());
  if (share < kFewest || share > kMost) return std::nullopt;
  found.center_px /= found.area_px;
  return found;
}

}  // namespace

double explained(const PhotoLevel& level, const Prediction& p, ScoredBy by) {
  constexpr double kFar = 0.7;  // standard deviations of the photograph
  constexpr int kRounds = 3;
  constexpr double kRidge = 1e-7;
  // Beyond the cuts of an open surface nothing is known, so nothing is explained either.
  const auto known = [&](int x, int y) {
    return p.border_px.empty() || (p.contains(x, y) && p.border_px[p.index(x, y)] > 0);
  };
  // Light, background, 1, photograph.
  constexpr int kMost = ShadingBasis::kMost + 2;
  using Row = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;
  const int lights = by == ScoredBy::lamp ? 1 : p.basis - 1, n = lights + 2;
  Row row(n + 1);
  const auto for_pixels = [&](const auto& use) {
    for (int y = 0; y < level.intrinsics.height; ++y)
      for (int x = 0; x < level.intrinsics.width; ++x) {
        if (!level.valid[level.index(x, y)]) continue;
        const float* phi = p.contains(x, y) ? p.phi_at(p.index(x, y)) : nullptr;
        for (int j = 0; j < lights; ++j) row[j] = phi ? phi[j] : 0;
        row[lights] = phi ? phi[p.basis - 1] : 1;
        row[n - 1] = 1;
        row[n] = level.luminance[level.index(x, y)];
        use(known(x, y));
      }
  };
  // What the photograph varies by as a whole, which is to be explained.
  double sum = 0, sum2 = 0, count = 0;
  for_pixels([&](bool) {
    sum += row[n];
    sum2 += row[n] * row[n];
    ++count;
  });
  const double mean = sum / std::max(1.0, count), variance = sum2 - sum * mean;
  if (!(variance > 0)) return -1;
  const double far2 = kFar * kFar * variance / count;
  Row weights = Row::Zero(n);
  // Highlights and instruments are explained by no light: what is far off counts less each time.
  for (int round = 0; round < kRounds; ++round) {
    Square m = Square::Zero(n + 1, n + 1);
    for_pixels([&](bool is_known) {
      if (!is_known) return;
      const double off = row[n] - weights.dot(row.head(n));
      m.selfadjointView<Eigen::Lower>().rankUpdate(row,
                                                   round > 0 ? robust_weight(off * off / far2) : 1);
    });
    m = m.selfadjointView<Eigen::Lower>();
    Square normal = m.topLeftCorner(n, n);
    normal.diagonal() = normal.diagonal() * (1 + kRidge) + Row::Constant(n, 1e-12);
    weights = solve_symmetric(normal, m.topRightCorner(n, 1));
  }
  if (lights == 1 && !(weights[0] > 0)) return -1;
  // Where nothing is known, the mean is all that is said: such a pose gains nothing by it.
  double left = 0;
  for_pixels([&](bool is_known) {
    const double off = row[n] - (is_known ? weights.dot(row.head(n)) : mean);
    left += std::min(far2, off * off);
  });
  return 1 - left / variance;
}

PoseCandidates::PoseCandidates(const RegisteredSurface& surface, const PhotoLevel& level,
                               const RefineOptions& options, const RunContext& context)
    : surface_(surface),
      level_(level),
      options_(options),
      context_(context),
      seen_(surface.open() ? std::nullopt : find_foreground(level)) {
  centered_.intrinsics = level.intrinsics;
  centered_.intrinsics.cx = level.intrinsics.width / 2.0;
  centered_.intrinsics.cy = level.intrinsics.height / 2.0;
  centered_.rays = pixel_rays(centered_.intrinsics);
}

std::vector<ObjectPose> PoseCandidates::all_round() const {
  constexpr int kDirections = 162, kRolls = 24;         // where the place is known
  constexpr int kDirectionsEach = 60, kRollsEach = 12;  // at each of the supposed places
  if (seen_) return around(kDirections, kRolls, {*seen_});
  const double w = level_.intrinsics.width, h = level_.intrinsics.height;
  std::vector<Foreground> supposed;
  for (const double share : {0.12, 0.3})
    for (const double x : {0.33, 0.5, 0.67})
      for (const double y : {0.33, 0.5, 0.67})
        supposed.push_back({share * w * h, Vector2d(x * w, y * h)});
  return around(kDirectionsEach, kRollsEach, supposed);
}

std::vector<ObjectPose> PoseCandidates::near(const ObjectPose& start) const {
  constexpr int kAxes = 14;
  std::vector<Quaterniond> rotations = {start.camera_from_world};
  for (const double angle : {0.25, 0.5})
    for (const Vector3d& axis : directions(kAxes))
      rotations.push_back(Quaterniond(Eigen::AngleAxisd(angle, axis)) * start.camera_from_world);
  std::vector<ObjectPose> poses;
  for (const Quaterniond& rotation : rotations) poses.push_back({rotation, start.center_camera_mm});
  if (!seen_) return poses;
  for (const View& turned : views(rotations))
    if (turned.area_px > 0) poses.push_back(placed(turned, 0, *seen_));
  return poses;
}

std::vector<double> PoseCandidates::scores(const std::vector<ObjectPose>& poses,
                                           ScoredBy by) const {
  std::vector<double> scores(poses.size());
  parallel_for(std::size_t{0}, poses.size(), [&](std::size_t i) {
    context_.throw_if_cancelled();
    scores[i] = explained(level_, picture(level_, poses[i]), by);
  });
  return scores;
}

Prediction PoseCandidates::picture(const PhotoLevel& level, const ObjectPose& pose) const {
  const ShadingBasis basis = basis_for(options_, pose);
  Prediction p;
  predict(surface_, level, pose, 1, basis, basis.first_weights(), {.smooth_outlines = false}, p);
  return p;
}

double PoseCandidates::usual_distance() const {
  constexpr double kFill = 0.35;  // of the picture's shorter side, the organ's radius
  const Intrinsics& k = level_.intrinsics;
  return k.fx * surface_.radius_mm() / (kFill * std::min(k.width, k.height));
}

PoseCandidates::View PoseCandidates::view(const Quaterniond& rotation) const {
  View view{rotation};
  const Prediction p = picture(centered_, {view.rotation, {0, 0, usual_distance()}});
  for (int y = p.top; y < p.top + p.height; ++y)
    for (int x = p.left; x < p.left + p.width; ++x) {
      const float coverage = p.coverage[p.index(x, y)];
      view.area_px += coverage;
      view.offset +=
          coverage * Vector2d((x + 0.5 - centered_.intrinsics.cx) / level_.intrinsics.fx,
                              (y + 0.5 - centered_.intrinsics.cy) / level_.intrinsics.fy);
    }
  if (view.area_px > 0) view.offset /= view.area_px;
  return view;
}

std::vector<PoseCandidates::View> PoseCandidates::views(
    const std::vector<Quaterniond>& rotations) const {
  std::vector<View> views(rotations.size());
  parallel_for(std::size_t{0}, rotations.size(),
               [&](std::size_t i) { views[i] = view(rotations[i]); });
  return views;
}

std::vector<ObjectPose> PoseCandidates::around(int direction_count, int rolls,
                                               const std::vector<Foreground>& places) const {
  std::vector<Quaterniond> rotations;
  for (const Vector3d& direction : directions(direction_count))
    rotations.push_back(facing(direction));
  std::vector<ObjectPose> poses;
  for (const View& view : views(rotations)) {
    if (!(view.area_px > 0)) continue;
    for (int roll = 0; roll < rolls; ++roll)
      for (const Foreground& place : places)
        poses.push_back(placed(view, 2 * std::numbers::pi * roll / rolls, place));
  }
  return poses;
}

// The view turned by `roll` and moved to where its area and centre are those of `place`.
ObjectPose PoseCandidates::placed(const View& view, double roll, const Foreground& place) const {
  const Intrinsics& k = level_.intrinsics;
  const double distance = usual_distance() * std::sqrt(view.area_px / place.area_px);
  const Vector3d ray((place.center_px.x() - k.cx) / k.fx, (place.center_px.y() - k.cy) / k.fy, 1);
  const Quaterniond turn = rotation_between(Vector3d::UnitZ(), ray) *
                           Quaterniond(Eigen::AngleAxisd(roll, Vector3d::UnitZ()));
  const Vector2d offset =
      (turn * Vector3d(view.offset.x(), view.offset.y(), 0)).head<2>() * usual_distance();
  ObjectPose pose;
  pose.camera_from_world = turn * view.rotation;
  pose.center_camera_mm = distance * ray - Vector3d(offset.x(), offset.y(), 0);
  return pose;
}

}  // namespace organbake
