// SPDX-License-Identifier: GPL-3.0-or-later
// Lines of sight to surface samples, in packets. Samples lie in Morton order, so that the rays of a
// packet are neighbours; eyes are asked far-apart ones first where one that sees is enough.
#include "placing.h"

#include <algorithm>
#include <numeric>

#include "organbake/core/parallel.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

// Of the surface's diagonal: far more than the tracer's own margin, far less than what anybody
// would call an obstacle.
constexpr double kStepBack = 1e-4;
constexpr std::size_t kRays = 64;  // traced at a time

// Ten bits of each axis, interleaved.
std::uint32_t morton_code(const Eigen::Vector3d& unit) {
  std::uint32_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    auto cell = static_cast<std::uint32_t>(std::clamp(unit[axis] * 1024, 0.0, 1023.0));
    for (int bit = 0; bit < 10; ++bit) code |= (cell >> bit & 1u) << (3 * bit + axis);
  }
  return code;
}

bool qualifies(const Eye& eye, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
               const SightLimits& limits) {
  const Eigen::Vector3d arm = eye.position_mm - point;
  const double along = arm.dot(normal);
  if (!(along > 0) || along * along < limits.least_cosine * limits.least_cosine * arm.squaredNorm())
    return false;
  if (limits.texel_mm <= 0) return true;
  const double texel = texel_mm(eye, point, normal);
  return texel > 0 && texel <= limits.texel_mm;
}

// Lines of sight collected and traced together.
class SightLines {
 public:
  SightLines(const RayScene& scene, double step_back_mm)
      : scene_(scene), step_back_mm_(step_back_mm) {}

  // Calls found(sample) for those seen, once enough have come together or at flush().
  template <class Found>
  void add(std::uint32_t sample, const Eigen::Vector3d& eye, const Eigen::Vector3d& point,
           const Found& found) {
    const Eigen::Vector3d arm = point - eye;
    rays_[count_] = {.origin = eye, .direction = arm, .t_max = 1 - step_back_mm_ / arm.norm()};
    samples_[count_] = sample;
    if (++count_ == kRays) flush(found);
  }
  template <class Found>
  void flush(const Found& found) {
    scene_.occluded(std::span(rays_).first(count_), std::span(occluded_).first(count_));
    for (std::size_t k = 0; k < count_; ++k) {
      if (!occluded_[k]) found(samples_[k]);
    }
    count_ = 0;
  }

 private:
  const RayScene& scene_;
  double step_back_mm_;
  std::size_t count_ = 0;
  std::array<Ray, kRays> rays_;
  std::array<std::uint32_t, kRays> samples_;
  std::array<std::uint8_t, kRays> occluded_;
};

// Visits the eyes far apart first: most samples are then seen after a few of them.
std::vector<std::size_t> scattered_order(std::size_t count) {
  auto step = static_cast<std::size_t>(0.6180339887498949 * static_cast<double>(count));
  while (step > 1 && std::gcd(step, count) != 1) --step;
  std::vector<std::size_t> order(count);
  for (std::size_t i = 0; i < count; ++i) order[i] = i * std::max<std::size_t>(step, 1) % count;
  return order;
}

}  // namespace

double texel_mm(const Eye& eye, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d arm = eye.position_mm - point;
  const double depth = -arm.dot(eye.forward), cosine = arm.dot(normal) / arm.norm();
  return depth / (eye.focal_px * cosine);
}

void append_sample(const SurfaceSamples& from, std::size_t i, SurfaceSamples& to) {
  to.faces.push_back(from.faces[i]);
  to.weights.push_back(from.weights[i]);
  to.points.push_back(from.points[i]);
  to.normals.push_back(from.normals[i]);
}

SurfaceSamples sample_surface(const TriangleMesh& surface, std::size_t count, std::uint64_t seed) {
  const AreaSampler sampler(surface, count, seed);
  std::vector<AreaSampler::Sample> drawn(count);
  parallel_for(std::size_t{0}, count, [&](std::size_t i) { drawn[i] = sampler.at(i); });
  Bounds box;
  for (const auto& sample : drawn) box.add(sample.point);
  const double size = std::max((box.max - box.min).maxCoeff(), 1e-300);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < count; ++i) {
    order.emplace_back(morton_code((drawn[i].point - box.min) / size), i);
  }
  std::sort(order.begin(), order.end());
  SurfaceSamples samples;
  for (const auto& [code, i] : order) {
    samples.faces.push_back(drawn[i].face);
    samples.weights.push_back(drawn[i].weights);
    samples.points.push_back(drawn[i].point);
    samples.normals.push_back(face_normal(surface, drawn[i].face));
  }
  return samples;
}

Sight::Sight(const TriangleMesh& surface)
    : scene_(surface), step_back_mm_(kStepBack * bounds(surface).diagonal()) {}

SampleBits Sight::seen_from(const Eye& eye, const SurfaceSamples& samples,
                            const SightLimits& limits, const SampleBits* among) const {
  SampleBits seen(samples.size());
  const auto found = [&](std::uint32_t i) { seen.set(i); };
  SightLines lines(scene_, step_back_mm_);
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    if (among && !among->test(i)) continue;
    if (!qualifies(eye, samples.points[i], samples.normals[i], limits)) continue;
    lines.add(i, eye.position_mm, samples.points[i], found);
  }
  lines.flush(found);
  return seen;
}

std::vector<SampleBits> Sight::seen_from_each(const std::vector<Eye>& eyes,
                                              const SurfaceSamples& samples,
                                              const SightLimits& limits,
                                              const SampleBits* among) const {
  std::vector<SampleBits> seen(eyes.size());
  parallel_for(std::size_t{0}, eyes.size(),
               [&](std::size_t e) { seen[e] = seen_from(eyes[e], samples, limits, among); });
  return seen;
}

SampleBits Sight::seen_from_any(const std::vector<Eye>& eyes, const SurfaceSamples& samples,
                                const SightLimits& limits) const {
  constexpr std::size_t kChunk = 4 * SampleBits::kWordBits;  // no two threads share a word
  const std::vector<std::size_t> order = scattered_order(eyes.size());
  SampleBits seen(samples.size());
  parallel_for(std::size_t{0}, (samples.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    std::vector<std::uint32_t> open(std::min(kChunk, samples.size() - chunk * kChunk));
    std::iota(open.begin(), open.end(), static_cast<std::uint32_t>(chunk * kChunk));
    const auto found = [&](std::uint32_t i) { seen.set(i); };
    SightLines lines(scene_, step_back_mm_);
    for (const std::size_t e : order) {
      for (const std::uint32_t i : open) {
        if (!qualifies(eyes[e], samples.points[i], samples.normals[i], limits)) continue;
        lines.add(i, eyes[e].position_mm, samples.points[i], found);
      }
      lines.flush(found);
      std::erase_if(open, [&](std::uint32_t i) { return seen.test(i); });
      if (open.empty()) break;
    }
  });
  return seen;
}

}  // namespace organbake
