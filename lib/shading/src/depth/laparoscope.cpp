// SPDX-License-Identifier: GPL-3.0-or-later
// Shape from shading for a lamp at the lens with 1/r² fall-off (Prados & Faugeras 2005). The
// viscosity solution by fast sweeping on a coarse level (with Richardson's extrapolation) gives a
// start without an initial guess; regularised least squares from coarse to fine then take noise and
// texture into account, which the solution of the equation cannot. A light beside the lens is a
// fixed point over both.
#include "organbake/shading/shape_from_shading.h"

#include <algorithm>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

// Whether two frames differ by more than their noise: squared differences of coarse images in units
// of their variance. Where they do not, the depth of the frame before stands, bit for bit, and a
// still scene does not flicker.

// Pixels enough to tell where something moves, and each the mean of enough others.
constexpr int kSide = 64;

// Squared differences in units of their variance. Noise alone gives 1 on average and, among a few
// thousand pixels, about 16 at most; as the noise is estimated, 0.5 to 1.4 and 24 were seen. Of the
// phantom's laparoscopy neighbouring frames give 37, and 785.
constexpr double kMostOnAverage = 1.5, kMostOfOne = 36;

// Highlights and instruments that come or go: of the pixels, those that count in one image only.
constexpr double kMostChanged = 0.01;

// A pixel at a mask's rim is the mean of what counts in it, which noise alone makes other parts of
// it in each frame. Its variance tells: it is that of fewer pixels. Of the rest this share will do.
constexpr double kWhole = 1.5, kLeastWhole = 0.5;

// Noise of colour passes into the albedo that is divided out, by this share of the brightness; it
// is smooth, so that the mean of many pixels does not lessen it.
constexpr double kAlbedoNoise = 0.003;

double least_variance(const CoarseImage& image) {
  float least = std::numeric_limits<float>::max();
  for (std::size_t k = 0; k < image.inside.size(); ++k)
    if (image.inside.values[k]) least = std::min(least, image.variance.values[k]);
  return least;
}

// `levels`: each half the size of the one before it.
CoarseImage coarse_image(const std::vector<ShadedImage>& levels) {
  const auto coarse = std::find_if(levels.begin(), levels.end() - 1, [](const ShadedImage& level) {
    return std::max(level.rays.width, level.rays.height) <= kSide;
  });
  return {coarse->intensity, coarse->variance, coarse->inside};
}

// Whether noise alone tells the two apart: nothing moved that these pixels could show, be it the
// whole scene by a little or one spot by more.
bool shows_the_same(const CoarseImage& before, const CoarseImage& now) {
  if (before.inside.width != now.inside.width || before.inside.height != now.inside.height)
    return false;
  const double most_before = kWhole * least_variance(before),
               most_now = kWhole * least_variance(now);
  double sum = 0, largest = 0;
  std::size_t changed = 0, compared = 0, either = 0;
  for (std::size_t k = 0; k < now.inside.size(); ++k) {
    const bool in_before = before.inside.values[k] != 0, in_now = now.inside.values[k] != 0;
    either += in_before || in_now;
    changed += in_before != in_now;
    if (!in_before || !in_now) continue;
    if (before.variance.values[k] > most_before || now.variance.values[k] > most_now) continue;
    const double difference = double(now.intensity.values[k]) - before.intensity.values[k];
    const double of_albedo = kAlbedoNoise * now.intensity.values[k];
    const double variance =
        double(now.variance.values[k]) + before.variance.values[k] + of_albedo * of_albedo;
    const double squared = difference * difference / variance;
    sum += squared;
    largest = std::max(largest, squared);
    ++compared;
  }
  return either > 0 && double(compared) >= kLeastWhole * double(either) &&
         double(changed) <= kMostChanged * double(either) &&
         sum <= kMostOnAverage * double(compared) && largest <= kMostOfOne;
}

// The coarsest level: fine enough for the shape of an organ, coarse enough to be solved almost
// exactly. Noise makes one source pixel of the upwind solution pull all that lies behind it, so a
// noisy image starts from larger pixels.
constexpr int kBaseSide = 64, kNoisyBaseSide = 32;
constexpr double kNoisy = 0.004;  // noise / mean brightness

// Only what counts, on a scale on which it is about 1.
ShadedImage prepared(const Plane& intensity, const Mask& inside, const RayGrid& rays,
                     RangeEstimate& estimate) {
  ShadedImage image{intensity, Plane(rays.width, rays.height, 1), inside, rays};
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < intensity.size(); ++k) {
    const float value = intensity.values[k];
    if (!(std::isfinite(value) && value >= 0)) image.inside.values[k] = 0;
    if (!image.inside.values[k]) continue;
    sum += value;
    ++count;
  }
  estimate.usable = sum > 0 && count > 0;
  estimate.intensity_unit = estimate.usable ? sum / count : 1;
  const float unit = static_cast<float>(1 / estimate.intensity_unit);
  for (std::size_t k = 0; k < intensity.size(); ++k)
    image.intensity.values[k] = image.inside.values[k] ? intensity.values[k] * unit : 0;
  estimate.noise = noise_level(image.intensity, image.inside);
  // The smallest noise that counts stands for rounding in single precision.
  const double variance = estimate.noise * estimate.noise + 1e-8;
  std::fill(image.variance.values.begin(), image.variance.values.end(),
            static_cast<float>(variance));
  return image;
}

std::vector<ShadedImage> pyramid_of(ShadedImage finest, int base_side) {
  std::vector<ShadedImage> levels = {std::move(finest)};
  while (std::max(levels.back().rays.width, levels.back().rays.height) > base_side)
    levels.push_back(halved(levels.back()));
  for (std::size_t i = 1; i < levels.size(); ++i)
    levels[i].intensity = centre_values(levels[i].intensity, levels[i].inside, static_cast<int>(i));
  return levels;
}

// Far below what noise can tell from black, the logarithm would make depth of nothing.
Plane log_image(const ShadedImage& image) {
  Plane logs = image.intensity;
  for (std::size_t k = 0; k < logs.size(); ++k) {
    const float floor = std::max(0.5F * std::sqrt(image.variance.values[k]), 2e-3F);
    logs.values[k] = std::log(std::max(logs.values[k], floor));
  }
  return logs;
}

Plane swept(const ShadedImage& image, const Plane* start) {
  const Plane logs = log_image(image);
  Plane v = start ? *start : farthest_log_range(logs);
  constexpr int kMostSweeps = 32;
  constexpr double kTolerance = 1e-4;
  sweep_log_range(logs, image.inside, image.rays, v, kMostSweeps, kTolerance);
  fill_outside(v, image.inside);
  return v;
}

// Upwind differences err by O(h); with the next finer level's solution the leading term goes
// (Richardson).
Plane coarse_solution(const std::vector<ShadedImage>& levels) {
  Plane v = swept(levels.back(), nullptr);
  if (levels.size() < 2) return v;
  const ShadedImage& finer = levels[levels.size() - 2];
  const Plane start = doubled(v, finer.rays.width, finer.rays.height);
  const Plane second = halved(swept(finer, &start));
  for (std::size_t k = 0; k < v.size(); ++k) v.values[k] = 2 * second.values[k] - v.values[k];
  return v;
}

void fit_level(const ShadedImage& image, const RangeFitOptions& options, Plane& v,
               RangeEstimate& estimate) {
  const FitSummary summary = fit_log_range(image, options, v);
  estimate.refinements += summary.inner_steps;
  estimate.misfit = summary.misfit;
}

Plane solve_cold(const std::vector<ShadedImage>& levels, const LaparoscopeOptions& options,
                 RangeEstimate& estimate) {
  Plane v = coarse_solution(levels);
  RangeFitOptions fit{.outer_steps = 4, .inner_steps = 300, .model_error = options.texture};
  fit_level(levels.back(), fit, v, estimate);
  fit.roughness = roughness_of(v, levels.back());
  fit_level(levels.back(), fit, v, estimate);
  fit.roughness = roughness_of(v, levels.back());
  fit.outer_steps = 2;
  fit.inner_steps = 15;
  for (std::size_t i = levels.size() - 1; i-- > 0;) {
    v = doubled(v, levels[i].rays.width, levels[i].rays.height);
    if (i == 0) fit.outer_steps = 1;
    fit_level(levels[i], fit, v, estimate);
  }
  return v;
}

// What changed since the previous frame is found on the coarse levels and added to its detail.
Plane solve_warm(const std::vector<ShadedImage>& levels, const LaparoscopeOptions& options,
                 const Plane& previous, std::optional<double> roughness, RangeEstimate& estimate) {
  std::vector<Plane> before = {previous};
  for (std::size_t i = 1; i < levels.size(); ++i) before.push_back(halved(before.back()));
  RangeFitOptions fit{.outer_steps = 2, .inner_steps = 60, .model_error = options.texture};
  Plane v = before.back();
  fit.roughness = roughness ? *roughness : roughness_of(v, levels.back());
  fit_level(levels.back(), fit, v, estimate);
  fit.outer_steps = 1;
  fit.inner_steps = 10;
  for (std::size_t i = levels.size() - 1; i-- > 0;) {
    Plane change = v;
    for (std::size_t k = 0; k < v.size(); ++k) change.values[k] -= before[i + 1].values[k];
    v = doubled(change, levels[i].rays.width, levels[i].rays.height);
    for (std::size_t k = 0; k < v.size(); ++k) v.values[k] += before[i].values[k];
    if (i == 0) fit.inner_steps = 5;
    fit_level(levels[i], fit, v, estimate);
  }
  estimate.warm = true;
  return v;
}

bool beside_or_beamed(const LaparoscopeOptions& o) {
  return o.light_offset_x_mm != 0 || o.light_offset_y_mm != 0 || o.beam_exponent != 0;
}

// The misfit that is left where noise and fine texture have averaged out.
double misfit_at_organ_scale(const std::vector<ShadedImage>& levels, const Plane& log_range) {
  ShadedImage image = levels.back();
  Plane v = log_range;
  for (std::size_t i = 1; i < levels.size(); ++i) v = halved(v);
  while (std::max(image.rays.width, image.rays.height) > kNoisyBaseSide) {
    image = halved(image);
    v = halved(v);
  }
  return fit_log_range(image, {.outer_steps = 0}, v).misfit;
}

// The image as a light at the optical centre would have made it, given a range.
void relight(const ShadedImage& seen, const LaparoscopeOptions& options, double range_mm,
             const Plane& log_range, ShadedImage& central) {
  Plane metric = log_range;
  const float shift = static_cast<float>(std::log(range_mm) - median_inside(metric, seen.inside));
  for (float& value : metric.values) value += shift;
  const Plane ratio = light_ratio(metric, seen.rays, options);
  for (std::size_t k = 0; k < ratio.size(); ++k) {
    central.intensity.values[k] = seen.intensity.values[k] / ratio.values[k];
    central.variance.values[k] = seen.variance.values[k] / (ratio.values[k] * ratio.values[k]);
  }
}

double mean_difference(const Plane& a, const Plane& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += std::abs(a.values[k] - b.values[k]);
  return sum / std::max<double>(1, static_cast<double>(a.size()));
}

// A fixed point: each range gives the image of a central light, and that image a better range. The
// light's ratio hangs on slopes, whose errors feed back: a smooth surface is asked for (granted a
// rough one, 10 mm beside the lens, the steps grew from the sixth on), and steps that grow again
// end it.
void relight_until_settled(const ShadedImage& seen, int base_side,
                           const LaparoscopeOptions& options, double range_mm,
                           RangeEstimate& estimate) {
  constexpr int kRelightings = 6;
  constexpr double kRoughness = 0.1, kGrowth = 1.5;
  double last_step = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRelightings; ++i) {
    ShadedImage central = seen;
    relight(seen, options, std::max(range_mm, 1.0), estimate.log_range, central);
    const std::vector<ShadedImage> levels = pyramid_of(std::move(central), base_side);
    Plane better = i == 0 ? solve_cold(levels, options, estimate)
                          : solve_warm(levels, options, estimate.log_range, kRoughness, estimate);
    const double step = mean_difference(better, estimate.log_range);
    if (i > 1 && step > kGrowth * last_step) return;
    last_step = step;
    estimate.log_range = std::move(better);
    estimate.unexplained = misfit_at_organ_scale(levels, estimate.log_range);
  }
}

// Nothing but noise is new. The depth stays, and what it was found from: else a scene that moves
// slowly enough would never be seen to move.
RangeEstimate taken_over(const RangeEstimate& previous, const RangeEstimate& now) {
  RangeEstimate estimate = previous;
  estimate.intensity_unit = now.intensity_unit;
  estimate.noise = now.noise;
  estimate.warm = true;
  estimate.refinements = 0;
  return estimate;
}

}  // namespace

void LaparoscopeOptions::check() const {
  const double offset = std::hypot(light_offset_x_mm, light_offset_y_mm);
  if (!(offset <= 50))
    throw UsageError("light_offset is " + to_text(offset) +
                     " mm; a laparoscope's light lies within 50 mm of its camera");
  if (!(beam_exponent >= 0 && beam_exponent <= 20))
    throw UsageError("beam is " + to_text(beam_exponent) + "; it must be in 0…20");
  if (!(texture >= 1e-4 && texture <= 1))
    throw UsageError("texture is " + to_text(texture) + "; it must be in 0.0001…1");
}

RangeEstimate shade_laparoscope(const Plane& intensity, const Mask& inside,
                                const Intrinsics& camera, const LaparoscopeOptions& options,
                                const RangeEstimate* previous, double range_mm) {
  options.check();
  camera.check();
  if (intensity.width != camera.width || intensity.height != camera.height ||
      inside.width != camera.width || inside.height != camera.height)
    throw BadDataError("shading: image, mask and camera are of different sizes");
  RangeEstimate estimate;
  ShadedImage image = prepared(intensity, inside, ray_grid(camera), estimate);
  if (!estimate.usable) {
    estimate.log_range = Plane(camera.width, camera.height);
    return estimate;
  }
  const int base = estimate.noise > kNoisy ? kNoisyBaseSide : kBaseSide;
  const std::vector<ShadedImage> levels = pyramid_of(std::move(image), base);
  const bool warm = previous && previous->log_range.width == camera.width &&
                    previous->log_range.height == camera.height;
  estimate.seen = coarse_image(levels);
  if (warm && shows_the_same(previous->seen, estimate.seen)) return taken_over(*previous, estimate);
  estimate.log_range = warm ? solve_warm(levels, options, previous->log_range, {}, estimate)
                            : solve_cold(levels, options, estimate);
  estimate.unexplained = misfit_at_organ_scale(levels, estimate.log_range);
  if (!beside_or_beamed(options)) return estimate;
  if (range_mm <= 0 && (options.light_offset_x_mm != 0 || options.light_offset_y_mm != 0))
    throw UsageError("a light beside the camera needs a range in mm: give --range-mm");
  relight_until_settled(levels.front(), base, options, range_mm, estimate);
  estimate.warm = warm;
  return estimate;
}

}  // namespace organbake
