// SPDX-License-Identifier: GPL-3.0-or-later
// A bed of tissue under a scope by its formula: rays meet a height field of bumps by safe steps,
// the light falls off with the squared distance, and depth, normals, albedo, highlights and
// instrument are told beside each frame.
#include "organbake/phantom/laparoscopy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

using Eigen::Vector3d;

constexpr double kBed_mm = 60;  // of the bed from the first camera
constexpr double kBedBend_per_mm = 0.0012;
constexpr double kReach_mm = 40;          // bumps lie within this of the axis
constexpr double kFarthestSeen_mm = 400;  // of what is seen from the camera, along its axis
const Vector3d kTissue(0.55, 0.20, 0.16), kOtherTissue(0.72, 0.52, 0.26);
const Vector3d kSteel(0.34, 0.35, 0.36);
constexpr double kInstrument_mm = 35;  // from the cameras
constexpr double kMoistGlint = 2.2, kMoistGlintExponent = 200;

// Where `below`, negative before the surface, changes sign within a step: by the secant, whose
// false end is halved (Illinois; Dowell & Jarratt 1971).
template <class Below>
double crossing(double before, double after, const Below& below) {
  constexpr int kMost = 30;
  constexpr double kClose_mm = 1e-12;
  double low = below(before), high = below(after), at = after;
  for (int i = 0; i < kMost && after - before > kClose_mm && high > low; ++i) {
    const double next = before - low * (after - before) / (high - low);
    if (std::abs(next - at) < kClose_mm) return next;
    at = next;
    const double value = below(at);
    if (value < 0) {
      before = at, low = value, high /= 2;
    } else {
      after = at, high = value, low /= 2;
    }
  }
  return at;
}

// Where a ray from `eye` first meets z = h(x, y), whose slope is at most `steepest`: by steps of a
// millimetre and bisection. Steps that cannot reach the surface are left out, and a bisection's
// side is told by the crossing, unless that is too near to tell.
template <class Height>
double first_hit(const Vector3d& eye, const Vector3d& ray, double steepest, const Height& height) {
  constexpr double kStep = 1.0, kFirst = 10, kTold_mm = 1e-10;
  const double closing = std::abs(ray.z()) + steepest * ray.head<2>().norm() + 1e-9;
  const auto below = [&](double t) {
    const Vector3d p = eye + t * ray;
    return p.z() - height(p.x(), p.y());
  };
  double t = kFirst;
  for (double left = below(t); left < 0; left = below(t)) {
    t += kStep * std::max(1.0, std::floor(-left / closing));
    if (t >= kFarthestSeen_mm) return std::numeric_limits<double>::infinity();
  }
  double before = std::max(kFirst, t - kStep), after = t;
  const double hit = crossing(before, after, below);
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (before + after);
    const bool in_front = std::abs(middle - hit) > kTold_mm ? middle < hit : below(middle) < 0;
    (in_front ? before : after) = middle;
  }
  return 0.5 * (before + after);
}

// In the frame's own units: a shaft from the right edge to beyond the middle.
bool under_instrument(double u, double v) {
  const double axis = 0.62 - 0.25 * (u - 0.6);
  return u > 0.62 && std::abs(v - axis) < 0.045 + (u < 0.7 ? -0.2 * (0.7 - u) : 0);
}

}  // namespace

LaparoscopyPhantom::LaparoscopyPhantom(const LaparoscopyOptions& options) : options_(options) {
  RandomStream random(options_.seed);
  for (int i = 0; i < 7; ++i) {
    const double radius = random.uniform(9, 20);
    bumps_.push_back({random.uniform(-kReach_mm, kReach_mm), random.uniform(-kReach_mm, kReach_mm),
                      radius, radius * random.uniform(0.25, 0.6) * (i % 3 == 2 ? -0.6 : 1)});
  }
  const auto nearer = [](const Bump& a, const Bump& b) {
    return std::hypot(a.x, a.y) < std::hypot(b.x, b.y);
  };
  middle_bump_ = std::min_element(bumps_.begin(), bumps_.end(), nearer) - bumps_.begin();
  RandomStream waves(options_.seed, 77);
  constexpr int kWaves = 12;
  for (int i = 0; i < kWaves; ++i) {
    Wave wave{};
    wave.angle_rad = waves.uniform(0, kTurn);
    wave.length_mm = waves.uniform(1.0, 4.0);
    wave.phase_rad = waves.uniform(0, kTurn);
    waves_.push_back(wave);
  }
}

double LaparoscopyPhantom::height_mm(double x_mm, double y_mm) const {
  double z = kBed_mm + kBedBend_per_mm * (x_mm * x_mm + y_mm * y_mm);
  for (const Bump& bump : bumps_) {
    const double dx = x_mm - bump.x, dy = y_mm - bump.y;
    z -= bump.height * std::exp(-(dx * dx + dy * dy) / (bump.radius * bump.radius));
  }
  return z;
}

double LaparoscopyPhantom::steepest_slope(double reach_mm) const {
  double slope = 2 * kBedBend_per_mm * reach_mm;
  for (const Bump& bump : bumps_)
    slope += std::sqrt(2 / std::numbers::e) * std::abs(bump.height) / bump.radius;
  return slope;
}

Vector3d LaparoscopyPhantom::normal_world(double x_mm, double y_mm) const {
  constexpr double kStep = 1e-4;
  const double p = (height_mm(x_mm + kStep, y_mm) - height_mm(x_mm - kStep, y_mm)) / (2 * kStep);
  const double q = (height_mm(x_mm, y_mm + kStep) - height_mm(x_mm, y_mm - kStep)) / (2 * kStep);
  return Vector3d(p, q, -1).normalized();
}

// Fine streaks and spots, a sum of waves: smooth, and the same from wherever it is seen.
double LaparoscopyPhantom::albedo_factor(const Vector3d& point) const {
  double sum = 0;
  for (const Wave& wave : waves_) {
    sum +=
        std::sin(kTurn / wave.length_mm *
                     (std::cos(wave.angle_rad) * point.x() + std::sin(wave.angle_rad) * point.y()) +
                 wave.phase_rad);
  }
  return 1 + options_.texture * sum / std::sqrt(waves_.size() / 2.0) / 1.5;
}

Vector3d LaparoscopyPhantom::tissue_color(const Vector3d& point) const {
  if (!options_.two_tissues) return kTissue;
  const Bump& bump = bumps_[middle_bump_];
  return std::hypot(point.x() - bump.x, point.y() - bump.y) < bump.radius ? kOtherTissue : kTissue;
}

PosedCamera LaparoscopyPhantom::camera(int frame) const {
  PosedCamera camera;
  camera.name = "frame_" + std::to_string(frame);
  camera.intrinsics = assumed_camera(options_.width, options_.height, options_.field_of_view_rad);
  const double t = 0.25 * frame;
  Vector3d eye(4 * std::sin(t), 3 * std::sin(0.7 * t), 4 * std::sin(0.4 * t));
  const Vector3d aim(0, 0, kBed_mm);
  if (options_.tilt_rad != 0)
    eye = aim + Eigen::AngleAxisd(options_.tilt_rad, Vector3d::UnitY()) * (eye - aim);
  camera.camera_from_world = look_at(eye, aim, Vector3d(0, -1, 0));
  return camera;
}

PosedCamera LaparoscopyPhantom::right_camera(int frame) const {
  PosedCamera right = camera(frame);
  right.name = "right_" + std::to_string(frame);
  right.camera_from_world.translation.x() -= options_.baseline_mm;
  return right;
}

Vector3d LaparoscopyPhantom::light_world_mm(int frame) const {
  return camera(frame).camera_from_world.inverse() * Vector3d(options_.light_offset_x_mm, 0, 0);
}

LaparoscopyFrame LaparoscopyPhantom::frame(int index) const {
  return frame_seen_by(camera(index), light_world_mm(index), 1000 * (index + 1));
}

LaparoscopyFrame LaparoscopyPhantom::right_frame(int index) const {
  const PosedCamera view = right_camera(index);
  const double shift = view.intrinsics.fx * options_.baseline_mm / kInstrument_mm / options_.width;
  return frame_seen_by(view, light_world_mm(index), 1000 * (index + 1) + 500, shift);
}

LaparoscopyFrame LaparoscopyPhantom::frame_seen_by(const PosedCamera& view, const Vector3d& light,
                                                   std::uint64_t noise_stream,
                                                   double instrument_shift) const {
  const int width = options_.width, height = options_.height;
  LaparoscopyFrame result{
      Rgb8Image(width, height),
      view,
      Plane(width, height, INFINITY),
      std::vector<Eigen::Vector3f>(std::size_t(width) * height, Eigen::Vector3f(0, 0, -1)),
      std::vector<Eigen::Vector3f>(std::size_t(width) * height, Eigen::Vector3f::Zero()),
      Mask(width, height),
      Mask(width, height)};
  const Eigen::Matrix3d world_from_camera = view.camera_from_world.rotation.transpose();
  const Vector3d eye = view.center_world_mm();
  const double nearest_mm = kBed_mm - 12;
  parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t k = result.depth_mm.index(x, y);
      RandomStream random(options_.seed + noise_stream, k);
      const double u = (x + 0.5) / width, v = (y + 0.5) / height;
      const double stop = std::hypot((u - 0.5) * width, (v - 0.5) * height) / (0.48 * height);
      if (options_.round_view && stop > 1) continue;
      const double vignette = 1 - 0.05 * std::min(1.0, stop * stop);
      Vector3d color;
      if (options_.instrument && under_instrument(u + instrument_shift, v)) {
        result.instrument.values[k] = 1;
        color = kSteel * (0.7 + 0.5 * std::sin(60 * v));
      } else {
        const Vector3d ray_camera = unproject(view.intrinsics, {x + 0.5, y + 0.5});
        const Vector3d ray = world_from_camera * ray_camera;
        const double steepest =
            steepest_slope(eye.head<2>().norm() + kFarthestSeen_mm * ray.head<2>().norm());
        const double z =
            first_hit(eye, ray, steepest, [&](double a, double b) { return height_mm(a, b); });
        if (!std::isfinite(z)) continue;
        const Vector3d point = eye + z * ray, normal = normal_world(point.x(), point.y());
        const Vector3d toward = light - point;
        const double off_axis = -(view.camera_from_world.rotation * toward.normalized()).z();
        const double beam = std::pow(std::max(0.0, off_axis), options_.beam_exponent);
        const double falloff = beam * nearest_mm * nearest_mm / toward.squaredNorm();
        const double lit = std::max(0.0, normal.dot(toward.normalized())) * falloff;
        const Vector3d half = (toward.normalized() - ray.normalized()).normalized();
        const double mirror = options_.highlights * kMoistGlint * falloff *
                              std::pow(std::max(0.0, normal.dot(half)), kMoistGlintExponent);
        // Moist tissue is rough on a small scale: it mirrors in spots, not in one large disc.
        const double spots = std::pow(
            0.5 + 0.25 * (albedo_factor(2.3 * point) - 1) / std::max(options_.texture, 1e-9), 4);
        const double glint = options_.texture > 0 ? 4 * mirror * spots : mirror;
        const Vector3d tissue = tissue_color(point);
        const Vector3d albedo = tissue * albedo_factor(point);
        color = lit * albedo + Vector3d::Constant(glint);
        result.albedo[k] = albedo.cast<float>();
        result.depth_mm.values[k] = static_cast<float>(z);
        result.normals[k] = (view.camera_from_world.rotation * normal).cast<float>();
        result.highlights.values[k] = glint > 0.5 * tissue.x() * lit;
      }
      for (int c = 0; c < 3; ++c) {
        const double value = vignette * color[c];
        const double encoded = srgb_from_linear(static_cast<float>(std::clamp(value, 0.0, 1.0)));
        result.image.at(x, y)[c] = static_cast<std::uint8_t>(
            std::lround(255 * std::clamp(encoded + options_.noise * random.normal(), 0.0, 1.0)));
      }
    }
  });
  return result;
}

}  // namespace organbake
