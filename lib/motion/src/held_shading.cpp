// SPDX-License-Identifier: GPL-3.0-or-later
//
// Depth of a key frame where parallax alone is not sure. In: the swept depths of several frames.
// They are held against each other, and lend each other what they are sure of; then one solve for
// ln r holds to parallax where that is certain, and bends between so that the picture under the
// lamp at the lens is explained. Out: depth with confidence.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"
#include "view_depths.h"

namespace organbake {
namespace {

// Shares of the depth by which two frames may differ about one place.
constexpr float kLeastApart = 0.015F, kMostApart = 0.05F;
constexpr float kTold = 0.05F;  // confidence that a partner needs to have a say

// The pixel of a grid that shows a point in its camera's axes; nothing behind it or outside.
std::optional<std::size_t> pixel_showing(const Eigen::Vector3d& point, const Intrinsics& lens,
                                         const Plane& grid) {
  if (!(point.z() > 0)) return std::nullopt;
  const Eigen::Vector2d pixel = project(lens, point);
  if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < grid.width && pixel.y() < grid.height))
    return std::nullopt;
  return grid.index(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
}

// For and against a depth, in partners.
struct Votes {
  float agree = 0, against = 0;
};

void ask(const Eigen::Vector3d& point, float sd, const PosedCamera& camera,
         const SweptDepth& partner, Votes& votes) {
  const Eigen::Vector3d there = camera.camera_from_world * point;
  const auto k = pixel_showing(there, camera.intrinsics, partner.depth);
  if (!k || partner.confidence.values[*k] < kTold) return;
  const float confidence = partner.confidence.values[*k];
  const float apart = static_cast<float>(there.z()) / partner.depth.values[*k] - 1;
  const float may =
      std::clamp(2 * std::hypot(sd, partner.relative_sd.values[*k]), kLeastApart, kMostApart);
  // Behind what the partner sees it may be hidden; that all partners say so is a coincidence.
  constexpr float kHidden = 0.3F;
  if (std::abs(apart) <= may) {
    votes.agree += confidence;
  } else {
    votes.against += confidence * (apart < 0 ? 1 : kHidden);
  }
}

Plane agreed_confidence(const std::vector<PosedCamera>& cameras,
                        const std::vector<std::size_t>& partners,
                        const std::vector<SweptDepth>& swept, std::size_t i) {
  const SweptDepth& own = swept[i];
  const RigidTransform world_from_camera = cameras[i].camera_from_world.inverse();
  Plane confidence = own.confidence;
  for (int y = 0; y < confidence.height; ++y)
    for (int x = 0; x < confidence.width; ++x) {
      float& value = confidence.at(x, y);
      if (!(value > 0)) continue;
      const Eigen::Vector3d ray = unproject(cameras[i].intrinsics, {x + 0.5, y + 0.5});
      const Eigen::Vector3d point = world_from_camera * Eigen::Vector3d(ray * own.depth.at(x, y));
      Votes votes;
      for (const std::size_t j : partners)
        ask(point, own.relative_sd.at(x, y), cameras[j], swept[j], votes);
      constexpr float kPrior = 0.5F;  // partners that agree before any is asked
      const float sure = 1 - (1 - value) * std::exp2(-votes.agree);
      value = sure * (votes.agree + kPrior) / (votes.agree + votes.against + kPrior);
    }
  return confidence;
}

}  // namespace

void check_agreement(const std::vector<PosedCamera>& cameras,
                     const std::vector<std::vector<std::size_t>>& partners,
                     std::vector<SweptDepth>& swept) {
  std::vector<Plane> confidences(swept.size());
  parallel_for(std::size_t{0}, swept.size(), [&](std::size_t i) {
    confidences[i] = agreed_confidence(cameras, partners[i], swept, i);
  });
  for (std::size_t i = 0; i < swept.size(); ++i) swept[i].confidence = std::move(confidences[i]);
}

namespace {

constexpr float kSure = 0.6F;  // confidence from which depth is lent
constexpr float kLent = 0.8F;  // share of it that arrives: tissue may have moved meanwhile

void lend(const SweptDepth& partner, const PosedCamera& from, const PosedCamera& to,
          SweptDepth& own) {
  const RigidTransform there_from_here = to.camera_from_world * from.camera_from_world.inverse();
  for (int y = 0; y < partner.depth.height; ++y)
    for (int x = 0; x < partner.depth.width; ++x) {
      const std::size_t k = partner.depth.index(x, y);
      const float confidence = kLent * partner.confidence.values[k];
      if (confidence < kLent * kSure) continue;
      const Eigen::Vector3d ray = unproject(from.intrinsics, {x + 0.5, y + 0.5});
      const Eigen::Vector3d point =
          there_from_here * Eigen::Vector3d(ray * partner.depth.values[k]);
      const auto at = pixel_showing(point, to.intrinsics, own.depth);
      // Of several lenders the surest has the say.
      if (!at || own.confidence.values[*at] >= confidence) continue;
      own.depth.values[*at] = static_cast<float>(point.z());
      own.relative_sd.values[*at] = partner.relative_sd.values[k];
      own.confidence.values[*at] = confidence;
    }
}

}  // namespace

void borrow_depth(const std::vector<PosedCamera>& cameras,
                  const std::vector<std::vector<std::size_t>>& partners,
                  std::vector<SweptDepth>& swept) {
  std::vector<SweptDepth> filled = swept;
  parallel_for(std::size_t{0}, swept.size(), [&](std::size_t i) {
    for (const std::size_t j : partners[i]) lend(swept[j], cameras[j], cameras[i], filled[i]);
  });
  swept = std::move(filled);
}

namespace {

constexpr int kBaseSide = 48;       // of the coarsest level
constexpr float kLeastSd = 0.006F;  // of ln r: poses and lens are no better
constexpr float kAlikePixels = 10;  // neighbouring matches share one window's errors
constexpr double kTexture = 0.3;    // share of the brightness that is no shape: texture and gloss
// Share of the picture's width over which the albedo may change by itself: what brightness says
// over longer ways is not believed.
constexpr double kAlbedoShare = 0.08;

// One level of the pyramid: the picture, and what parallax holds.
struct HeldLevel {
  ShadedImage image;
  HeldRange held;
};

HeldRange held_range(const SweptDepth& swept, const RayGrid& rays) {
  HeldRange held{Plane(rays.width, rays.height), Plane(rays.width, rays.height)};
  for (int y = 0; y < rays.height; ++y)
    for (int x = 0; x < rays.width; ++x) {
      const std::size_t k = held.weight.index(x, y);
      const float confidence = swept.confidence.values[k];
      if (!(confidence > 0) || !std::isfinite(swept.depth.values[k])) continue;
      const double along = std::hypot(1.0, rays.x(x), rays.y(y));
      held.log_range.values[k] = static_cast<float>(std::log(swept.depth.values[k] * along));
      const float sd = std::hypot(kLeastSd, swept.relative_sd.values[k]);
      // Half a doubt is much doubt: a chance match is off by far more than its spread.
      const float certainty = confidence * confidence;
      held.weight.values[k] = certainty * certainty / (sd * sd * kAlikePixels);
    }
  return held;
}

// Means of 2×2 by their weights, whose sum the coarse pixel has.
HeldRange halved(const HeldRange& fine) {
  HeldRange coarse{Plane((fine.weight.width + 1) / 2, (fine.weight.height + 1) / 2), {}};
  coarse.weight = coarse.log_range;
  for (int y = 0; y < fine.weight.height; ++y)
    for (int x = 0; x < fine.weight.width; ++x) {
      const float w = fine.weight.at(x, y);
      coarse.weight.at(x / 2, y / 2) += w;
      coarse.log_range.at(x / 2, y / 2) += w * fine.log_range.at(x, y);
    }
  for (std::size_t k = 0; k < coarse.weight.size(); ++k)
    if (coarse.weight.values[k] > 0) coarse.log_range.values[k] /= coarse.weight.values[k];
  return coarse;
}

// What a smooth surface cannot follow loses its weight (Cauchy).
HeldRange let_go(const HeldRange& held, const Plane& v, float usual) {
  HeldRange robust = held;
  for (std::size_t k = 0; k < v.size(); ++k) {
    const float off = (v.values[k] - held.log_range.values[k]) / usual;
    robust.weight.values[k] /= 1 + off * off;
  }
  return robust;
}

// ln of what a surface r = e^v sends back of a lamp at the lens, albedo 1.
Plane log_model(const Plane& v, const RayGrid& rays) {
  const std::vector<Eigen::Vector3f> normals = normals_from_log_range(v, rays);
  Plane model(v.width, v.height);
  for (int y = 0; y < v.height; ++y)
    for (int x = 0; x < v.width; ++x) {
      const Eigen::Vector3f ray =
          Eigen::Vector3f(static_cast<float>(rays.x(x)), static_cast<float>(rays.y(y)), 1)
              .normalized();
      constexpr float kGrazing = 0.05F;
      const float cosine = std::max(kGrazing, -normals[v.index(x, y)].dot(ray));
      model.at(x, y) = std::log(cosine) - 2 * v.at(x, y);
    }
  return model;
}

// Means over the inside of a window, thrice, so that its corners do not show; bridged outside.
Plane slowly(Plane plane, const Mask& inside, int radius) {
  fill_outside(plane, inside);
  const Mask all(plane.width, plane.height, 1);
  for (int i = 0; i < 3; ++i) plane = box_mean(plane, all, radius);
  return plane;
}

class HeldFit {
 public:
  HeldFit(const PreparedFrame& frame, const SweptDepth& swept) : rays_(ray_grid(frame.camera)) {
    levels_.push_back({shaded(frame), held_range(swept, rays_)});
    while (std::max(levels_.back().image.rays.width, levels_.back().image.rays.height) > kBaseSide)
      levels_.push_back({halved(levels_.back().image), halved(levels_.back().held)});
  }

  Plane run() {
    Plane v = from_parallax();
    for (std::size_t i = levels_.size() - 1; i-- > 0;) {
      v = doubled(v, levels_[i].image.rays.width, levels_[i].image.rays.height);
      fit(levels_[i], true, {.outer_steps = 1, .inner_steps = i == 0 ? 25 : 60}, v);
    }
    return v;
  }

 private:
  ShadedImage shaded(const PreparedFrame& frame) const {
    ShadedImage image{frame.intensity, Plane(rays_.width, rays_.height, 1), frame.diffuse, rays_};
    // Glow and sharpening reach round highlights.
    const int rim = std::max(1, rays_.width / 128);
    image.inside = without(image.inside, dilated(frame.highlights, rim));
    std::vector<float> values;
    for (std::size_t k = 0; k < image.inside.size(); ++k) {
      const float value = frame.intensity.values[k];
      if (!(std::isfinite(value) && value > 0)) image.inside.values[k] = 0;
      if (image.inside.values[k]) values.push_back(value);
    }
    const float unit = values.empty() ? 1 : median(std::move(values));
    for (float& value : image.intensity.values) value /= unit;
    return image;
  }

  // The coarsest level: a smooth surface through what parallax holds, stray matches let go.
  Plane from_parallax() {
    const HeldLevel& level = levels_.back();
    Mask known(level.held.weight.width, level.held.weight.height);
    for (std::size_t k = 0; k < known.size(); ++k)
      known.values[k] = level.held.weight.values[k] > 0;
    Plane v = level.held.log_range;
    fill_outside(v, known);
    v = box_mean(v, Mask(v.width, v.height, 1), 2);
    for (int i = 0; i < 4; ++i) fit(level, false, {.outer_steps = 1, .inner_steps = 300}, v);
    fit(level, true, {.outer_steps = 1, .inner_steps = 300}, v);
    fit(level, true, {.outer_steps = 1, .inner_steps = 300}, v);
    return v;
  }

  void fit(const HeldLevel& level, bool shading, RangeFitOptions fit_options, Plane& v) const {
    constexpr float kUsual = 0.1F;  // an edge of an organ is no stray match
    constexpr double kRoughness = 1;
    fit_options.model_error = kTexture;
    fit_options.roughness = kRoughness;
    const HeldRange held = let_go(level.held, v, kUsual);
    ShadedImage image = level.image;
    if (shading) {
      divide_albedo_out(v, image);
    } else {
      std::fill(image.inside.values.begin(), image.inside.values.end(), std::uint8_t{0});
    }
    fit_log_range(image, fit_options, v, &held);
  }

  // What of the brightness v does not explain is albedo where it changes slowly, and is doubted
  // where it does not.
  void divide_albedo_out(const Plane& v, ShadedImage& image) const {
    const Plane model = log_model(v, image.rays);
    Plane left(v.width, v.height);
    for (std::size_t k = 0; k < v.size(); ++k)
      if (image.inside.values[k])
        left.values[k] = std::log(std::max(image.intensity.values[k], 1e-4F)) - model.values[k];
    const int radius =
        std::max(1, static_cast<int>(std::lround(kAlbedoShare * image.rays.width / 2)));
    const Plane albedo = slowly(left, image.inside, radius);
    for (std::size_t k = 0; k < v.size(); ++k) {
      if (!image.inside.values[k]) continue;
      const float gain = std::exp(-albedo.values[k]);
      image.intensity.values[k] *= gain;
      constexpr float kUsual = 0.25F;  // of ln brightness
      const float off = (left.values[k] - albedo.values[k]) / kUsual;
      const float model_here = std::exp(model.values[k]);
      image.variance.values[k] = model_here * model_here * (1e-4F + 0.02F * off * off);
    }
  }

  RayGrid rays_;
  std::vector<HeldLevel> levels_;
};

// The share of certain parallax in the surroundings that shading reaches.
Plane support_of(const SweptDepth& swept, double reach_share) {
  const Mask all(swept.confidence.width, swept.confidence.height, 1);
  const int radius =
      std::max(1, static_cast<int>(std::lround(reach_share * swept.confidence.width / 2)));
  return box_mean(box_mean(swept.confidence, all, radius), all, radius);
}

}  // namespace

FrameDepth fill_by_shading(const PreparedFrame& frame, const SweptDepth& swept,
                           double reach_share) {
  if (std::none_of(swept.confidence.values.begin(), swept.confidence.values.end(),
                   [](float c) { return c > 0; }))
    throw BadDataError("held shading: parallax tells no depth of this frame");
  const RayGrid rays = ray_grid(frame.camera);
  FrameDepth result;
  result.range.log_range = HeldFit(frame, swept).run();
  const Plane& v = result.range.log_range;
  const Plane support = support_of(swept, reach_share);
  Mask reached = frame.tissue;
  constexpr float kLeastSupport = 0.02F, kFilled = 0.5F;
  result.confidence = Plane(rays.width, rays.height);
  for (std::size_t k = 0; k < reached.size(); ++k) {
    if (!reached.values[k]) continue;
    reached.values[k] = support.values[k] >= kLeastSupport;
    if (reached.values[k])
      result.confidence.values[k] =
          std::max(swept.confidence.values[k], kFilled * std::min(1.F, support.values[k]));
  }
  result.depth = depth_from_log_range(v, rays, reached);
  result.normals = normals_from_log_range(v, rays);
  return result;
}

}  // namespace organbake
