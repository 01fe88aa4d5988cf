// SPDX-License-Identifier: GPL-3.0-or-later
// Clips of a scope that moves over breathing tissue: rays meet the relief (tissue_relief.cpp) as
// the breath has pushed it, colours come from its skin (tissue_skin.cpp), and the sensor takes what
// is left after jerks, stop and noise (scope_motion.cpp). Rows are drawn by several threads, each
// pixel's noise by its own place.
#include "organbake/phantom/laparoscopy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "formulas.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/random.h"
#include "organbake/core/text.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTracedSpacing_mm = 0.5, kTruthSpacing_mm = 0.5;
// Light on tissue that faces the scope at the picture's typical distance.
constexpr double kExposure = 1.2;
constexpr double kFilmGlint = 2.2, kFilmGlintExponent = 350, kLeastGlintCosine = 0.9;
const Vector3d kShaftSteel(0.2, 0.205, 0.21);
constexpr double kShaftGlint = 0.6, kShaftGlintExponent = 60;
constexpr double kStopRadius = 0.46;  // of the picture's width

// A jerk's trail at the middle of the picture, and which way it goes.
struct Jerk {
  double length_px = 0, direction_rad = 0;
};

constexpr double kShortestJerk = 6.0 / 1280, kLongestJerk = 18.0 / 1280;  // of the width

double jerk_reach_px(int width) { return kLongestJerk * width + 1; }

std::vector<Jerk> jerks(const MovingClipOptions& options) {
  constexpr int kLongestRun = 3;  // frames
  const auto frames = static_cast<std::size_t>(options.view.frames);
  std::vector<Jerk> result(frames);
  auto left = static_cast<std::size_t>(std::lround(options.blurred * static_cast<double>(frames)));
  RandomStream random(options.view.seed, 905);
  while (left > 0) {
    const std::size_t first = random.below(frames), count = 1 + random.below(kLongestRun);
    for (std::size_t i = first; i < std::min(first + count, frames) && left > 0; ++i) {
      if (result[i].length_px > 0) continue;
      result[i] = {options.view.width * random.uniform(kShortestJerk, kLongestJerk),
                   random.uniform(0, 2 * std::numbers::pi)};
      --left;
    }
  }
  return result;
}

// All that the pixels of one frame are drawn from.
struct Moment {
  PosedCamera camera;
  Eigen::Matrix3d world_from_camera;
  Vector3d eye, lamp;
  double breath_mm = 0;
  std::shared_ptr<const RayScene> surface;  // where a breath has moved it
  CrossingInstrument instrument{0};
  double reference_mm = 1;  // distance at which the lamp's light is 1
  ScopeSensor sensor;
};

// What a pixel shows.
struct Seen {
  Vector3d radiance = Vector3d::Zero();
  double depth_mm = std::numeric_limits<double>::infinity();
  Vector3d normal_world = Vector3d::Zero(), albedo = Vector3d::Zero();
  bool highlight = false, instrument = false;
};

double mirrored(const Vector3d& normal, const Vector3d& toward, const Vector3d& ray,
                double exponent) {
  const double half = normal.dot((toward - ray.normalized()).normalized());
  return half > kLeastGlintCosine ? std::pow(half, exponent) : 0;
}

}  // namespace

void MovingClipOptions::check() const {
  require(view.baseline_mm == 0, "baseline_mm", view.baseline_mm,
          "a clip along a path has one eye; leave the baseline or the path out");
  require(view.tilt_rad == 0, "tilt_rad", view.tilt_rad,
          "a path has its own views; leave the tilt or the path out");
}

struct MovingClip::Impl {
  explicit Impl(const MovingClipOptions& o)
      : options((o.check(), o)),
        relief(o.view.seed),
        skin(relief, o.view.seed, o.view.texture),
        jerks(organbake::jerks(o)),
        at_rest(std::make_shared<const RayScene>(relief.surface(kTracedSpacing_mm))) {}

  double share(int frame) const {
    return options.view.frames > 1 ? static_cast<double>(frame) / (options.view.frames - 1) : 0;
  }

  Moment moment(int frame, const PosedCamera& camera, double breath_mm) const;
  double typical_distance_mm(const Moment& moment) const;
  Seen seen_at(const Moment& moment, const Ray& ray, const RayHit& hit) const;
  Seen tissue_at(const Moment& moment, const Ray& ray, double length) const;
  Seen instrument_at(const Moment& moment, const Ray& ray,
                     const CrossingInstrument::Hit& hit) const;
  double refined_length(const Moment& moment, const Ray& ray, double length) const;
  void draw_row(const Moment& moment, int y, SensorLight& light, LaparoscopyFrame& truth) const;

  MovingClipOptions options;
  TissueRelief relief;
  TissueSkin skin;
  std::vector<Jerk> jerks;
  std::shared_ptr<const RayScene> at_rest;
};

Moment MovingClip::Impl::moment(int frame, const PosedCamera& camera, double breath_mm) const {
  Moment m;
  m.camera = camera;
  m.world_from_camera = camera.camera_from_world.rotation.transpose();
  m.eye = camera.center_world_mm();
  m.lamp = m.eye + m.world_from_camera * Vector3d(options.view.light_offset_x_mm, 0, 0);
  m.breath_mm = breath_mm;
  m.surface = breath_mm > 0
                  ? std::make_shared<const RayScene>(relief.surface(kTracedSpacing_mm, breath_mm))
                  : at_rest;
  if (options.view.instrument) m.instrument = CrossingInstrument(share(frame));
  m.sensor = {.noise = options.view.noise,
              .stop_radius_px = options.view.round_view ? kStopRadius * options.view.width : 0,
              .seed = options.view.seed,
              .stream = static_cast<std::uint64_t>(1000) * (frame + 1)};
  m.reference_mm = std::sqrt(kExposure) * typical_distance_mm(m);
  return m;
}

// The median of a few rays' ways to the tissue.
double MovingClip::Impl::typical_distance_mm(const Moment& moment) const {
  constexpr int kColumns = 16, kRows = 9;
  const Intrinsics& lens = moment.camera.intrinsics;
  std::vector<double> distances;
  for (int i = 0; i < kColumns * kRows; ++i) {
    Ray ray;
    ray.origin = moment.eye;
    ray.direction =
        moment.world_from_camera * unproject(lens, {(i % kColumns + 0.5) / kColumns * lens.width,
                                                    (i / kColumns + 0.5) / kRows * lens.height});
    RayHit hit;
    moment.surface->first_hits({&ray, 1}, {&hit, 1});
    if (hit.face != kNoHit) distances.push_back(hit.t * ray.direction.norm());
  }
  if (distances.empty()) return 1;
  return median(std::move(distances));
}

// The mesh brings the ray near, Newton's steps put it on the spline.
double MovingClip::Impl::refined_length(const Moment& moment, const Ray& ray, double length) const {
  constexpr double kLongestStep_mm = 0.1, kNear_mm = 2e-3, kGrazing = 0.05;
  for (int i = 0; i < 3; ++i) {
    const Vector3d point = ray.origin + length * ray.direction;
    const TissueRelief::Height h = relief.at(point.x(), point.y(), moment.breath_mm).height;
    const double closing =
        ray.direction.z() - h.slope_x * ray.direction.x() - h.slope_y * ray.direction.y();
    if (closing < kGrazing) break;
    const double step = (h.z_mm - point.z()) / closing;
    length += std::clamp(step, -kLongestStep_mm, kLongestStep_mm);
    if (std::abs(step) < kNear_mm) break;  // the next one would be some nanometres
  }
  return length;
}

Seen MovingClip::Impl::tissue_at(const Moment& moment, const Ray& ray, double length) const {
  Seen seen;
  seen.depth_mm = refined_length(moment, ray, length);
  const Vector3d point = ray.origin + seen.depth_mm * ray.direction;
  const TissueRelief::Breathed place = relief.at(point.x(), point.y(), moment.breath_mm);
  const TissueSkin::Sample skin_here = skin.at(place.rest_x_mm, place.rest_y_mm);
  const Vector2d slope(place.height.slope_x, place.height.slope_y);
  const Vector2d film = slope + skin_here.film_tilt;
  seen.normal_world = Vector3d(slope.x(), slope.y(), -1).normalized();
  seen.albedo = skin_here.albedo;
  const Vector3d way = moment.lamp - point, toward = way.normalized();
  const double off_axis = -(moment.camera.camera_from_world.rotation.row(2) * toward).value();
  const double beam = std::pow(std::max(0.0, off_axis), options.view.beam_exponent);
  const double strength = beam * moment.reference_mm * moment.reference_mm / way.squaredNorm();
  const double lit = std::max(0.0, seen.normal_world.dot(toward)) * strength;
  const double glint = options.view.highlights * kFilmGlint * strength *
                       mirrored(Vector3d(film.x(), film.y(), -1).normalized(), toward,
                                ray.direction, kFilmGlintExponent);
  seen.radiance = lit * seen.albedo + Vector3d::Constant(glint);
  seen.highlight = glint > 0.5 * seen.albedo.x() * lit;
  return seen;
}

Seen MovingClip::Impl::instrument_at(const Moment& moment, const Ray& ray,
                                     const CrossingInstrument::Hit& hit) const {
  const Vector3d way = moment.lamp - (ray.origin + hit.length * ray.direction);
  const Vector3d toward = way.normalized();
  const double strength = moment.reference_mm * moment.reference_mm / way.squaredNorm();
  Seen seen;
  seen.instrument = true;
  seen.radiance =
      strength * (std::max(0.0, hit.normal.dot(toward)) * kShaftSteel +
                  Vector3d::Constant(kShaftGlint * mirrored(hit.normal, toward, ray.direction,
                                                            kShaftGlintExponent)));
  return seen;
}

Seen MovingClip::Impl::seen_at(const Moment& moment, const Ray& ray, const RayHit& hit) const {
  const auto steel = moment.instrument.first_hit(ray.origin, ray.direction);
  if (steel && steel->length < hit.t) return instrument_at(moment, ray, *steel);
  if (hit.face == kNoHit) return {};
  return tissue_at(moment, ray, hit.t);
}

void MovingClip::Impl::draw_row(const Moment& moment, int y, SensorLight& light,
                                LaparoscopyFrame& truth) const {
  // A jerk's trail takes some light from behind the stop.
  const double beyond_px = jerk_reach_px(options.view.width);
  const auto [first, last] =
      columns_in_stop(moment.sensor, beyond_px, light.width, light.height, y);
  std::vector<Ray> rays(last - first);
  std::vector<RayHit> hits(rays.size());
  for (int x = first; x < last; ++x) {
    rays[x - first].origin = moment.eye;
    rays[x - first].direction =
        moment.world_from_camera * unproject(moment.camera.intrinsics, {x + 0.5, y + 0.5});
  }
  moment.surface->first_hits(rays, hits);
  for (int x = first; x < last; ++x) {
    const Seen seen = seen_at(moment, rays[x - first], hits[x - first]);
    const std::size_t k = truth.depth_mm.index(x, y);
    light.radiance[k] = seen.radiance.cast<float>();
    if (behind_stop(moment.sensor, light.width, light.height, x, y)) continue;
    truth.instrument.values[k] = seen.instrument;
    if (!std::isfinite(seen.depth_mm)) continue;
    truth.depth_mm.values[k] = static_cast<float>(seen.depth_mm);
    truth.normals[k] = (moment.camera.camera_from_world.rotation * seen.normal_world).cast<float>();
    truth.albedo[k] = seen.albedo.cast<float>();
    truth.highlights.values[k] = seen.highlight;
  }
}

MovingClip::MovingClip(const MovingClipOptions& options)
    : impl_(std::make_unique<const Impl>(options)) {}
MovingClip::~MovingClip() = default;
MovingClip::MovingClip(MovingClip&&) noexcept = default;

PosedCamera MovingClip::camera(int frame) const {
  constexpr std::size_t kDigits = 6;
  const LaparoscopyOptions& view = impl_->options.view;
  const ScopePose pose = scope_pose(impl_->options.path, impl_->share(frame));
  PosedCamera camera;
  camera.name = "frame_" + padded(static_cast<std::size_t>(frame), kDigits);
  camera.intrinsics = assumed_camera(view.width, view.height, view.field_of_view_rad);
  camera.intrinsics.fx *= pose.zoom;
  camera.intrinsics.fy *= pose.zoom;
  camera.camera_from_world = pose.camera_from_world;
  return camera;
}

double MovingClip::breath_mm(int frame) const {
  const MovingClipOptions& o = impl_->options;
  return o.breathing_mm *
         std::pow(std::sin(std::numbers::pi * time_s(frame) / o.breathing_period_s), 4);
}

double MovingClip::blur_px(int frame) const {
  return impl_->jerks[static_cast<std::size_t>(frame)].length_px;
}

LaparoscopyFrame MovingClip::frame(int index, const RunContext& context) const {
  const Moment moment = impl_->moment(index, camera(index), breath_mm(index));
  const int width = moment.camera.intrinsics.width, height = moment.camera.intrinsics.height;
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  LaparoscopyFrame result{{},
                          moment.camera,
                          Plane(width, height, INFINITY),
                          std::vector<Eigen::Vector3f>(pixels, Eigen::Vector3f(0, 0, -1)),
                          std::vector<Eigen::Vector3f>(pixels, Eigen::Vector3f::Zero()),
                          Mask(width, height),
                          Mask(width, height)};
  SensorLight light(width, height);
  parallel_for(0, height, [&](int y) {
    context.throw_if_cancelled();
    impl_->draw_row(moment, y, light, result);
  });
  const Jerk& jerk = impl_->jerks[static_cast<std::size_t>(index)];
  if (jerk.length_px > 0) {
    const double angle_rad = jerk.length_px / moment.camera.intrinsics.fx;
    light = blurred_by_turn(
        light, moment.camera.intrinsics,
        angle_rad * Vector2d(std::cos(jerk.direction_rad), std::sin(jerk.direction_rad)));
  }
  result.image = exposed(light, moment.sensor);
  return result;
}

TriangleMesh MovingClip::surface() const {
  TriangleMesh mesh = impl_->relief.surface(kTruthSpacing_mm);
  for (const Vector3d& vertex : mesh.vertices)
    mesh.colors.push_back(impl_->skin.at(vertex.x(), vertex.y()).albedo.cast<float>());
  return mesh;
}

}  // namespace organbake
