// SPDX-License-Identifier: Apache-2.0
// Pressures that keep the volume inside of parts of tissue: the volume and its gradient by the
// divergence theorem over their faces, and one unknown for each part beside the contacts' forces.
#include "solver/shape_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace organbake::deform {
namespace {

// A part flatter than this share of its own extent cubed has no inside worth keeping.
constexpr double kFlat = 1e-6;

struct DirectedEdge {
  std::uint32_t low, high;
  int direction;
};

std::vector<DirectedEdge> edges_of(const std::vector<Face>& faces) {
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * faces.size());
  for (const Face& f : faces) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t a = f[corner], b = f[(corner + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const DirectedEdge& p, const DirectedEdge& q) {
    return p.low != q.low ? p.low < q.low : p.high < q.high;
  });
  return edges;
}

}  // namespace

EnclosedVolume::EnclosedVolume(const Tissue& tissue, const std::vector<double>& volume_stiffness)
    : body_of_slot_(tissue.size(), kNoBody), free_count_(tissue.free_count()) {
  const auto is_free = [](double stiffness) { return stiffness <= 0; };
  if (std::all_of(volume_stiffness.begin(), volume_stiffness.end(), is_free)) return;
  const auto closed = closed_parts(tissue);
  std::vector<Bounds> box(tissue.part_count());
  for (std::size_t slot = 0; slot < tissue.size(); ++slot) {
    box[tissue.part_of_slot()[slot]].add(tissue.rest()[slot].head<3>());
  }
  std::vector<std::uint32_t> body_of_part(tissue.part_count(), kNoBody);
  std::vector<double> stiffness_of_part(tissue.part_count(), 1.0);
  for (const Face& f : tissue.faces()) {
    const std::uint32_t part = tissue.part_of_slot()[f[0]];
    if (!closed[part] || is_free(volume_stiffness[tissue.organ_of_slot()[f[0]]])) continue;
    if (body_of_part[part] == kNoBody) {
      body_of_part[part] = static_cast<std::uint32_t>(bodies_.size());
      stiffness_of_part[part] = volume_stiffness[tissue.organ_of_slot()[f[0]]];
      bodies_.push_back({padded(box[part].center()), 0, 0});
    }
    faces_.push_back({f, body_of_part[part]});
  }
  std::vector<double> volumes;
  measure(tissue.rest(), volumes);
  for (std::uint32_t part = 0; part < tissue.part_count(); ++part) {
    const std::uint32_t b = body_of_part[part];
    if (b == kNoBody) continue;
    const double v = bodies_[b].rest_mm3 = volumes[b];
    const double stiffness = stiffness_of_part[part];
    bodies_[b].compliance =
        stiffness >= 1 ? 0 : v * v / tissue.bulk_energy()[part] * (1 - stiffness) / stiffness;
    const bool flat = !(std::abs(v) > kFlat * std::pow(box[part].diagonal(), 3));
    if (!flat && std::isfinite(bodies_[b].compliance)) continue;
    // A refused body keeps its number but owns no slot and no face.
    body_of_part[part] = kNoBody;
    bodies_[b].rest_mm3 = 0;
  }
  std::erase_if(faces_, [&](const BodyFace& f) {
    return body_of_part[tissue.part_of_slot()[f.slots[0]]] == kNoBody;
  });
  for (std::size_t slot = 0; slot < tissue.size(); ++slot) {
    body_of_slot_[slot] = body_of_part[tissue.part_of_slot()[slot]];
  }
  if (faces_.empty()) bodies_.clear();
}

std::vector<std::uint8_t> EnclosedVolume::closed_parts(const Tissue& tissue) const {
  std::vector<std::uint8_t> closed(tissue.part_count(), 1);
  const auto edges = edges_of(tissue.faces());
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    int balance = 0;
    for (end = begin; end < edges.size() && edges[end].low == edges[begin].low &&
                      edges[end].high == edges[begin].high;
         ++end) {
      balance += edges[end].direction;
    }
    const bool anchored = edges[begin].low >= tissue.free_count();
    if (balance != 0 && !anchored) closed[tissue.part_of_slot()[edges[begin].low]] = 0;
  }
  return closed;
}

void EnclosedVolume::measure(const PaddedVectors& x, std::vector<double>& volumes_mm3) const {
  volumes_mm3.assign(bodies_.size(), 0.0);
  const Double4* at = as_double4(x.data());
  for (auto f = faces_.begin(); f != faces_.end();) {  // by runs of one body
    const std::uint32_t body = f->body;
    const Double4 origin = *as_double4(&bodies_[body].origin);
    Double4 products{};
    for (; f != faces_.end() && f->body == body; ++f) {
      const Double4 a = at[f->slots[0]] - origin, b = at[f->slots[1]] - origin;
      products += a * cross(b, at[f->slots[2]] - origin);
    }
    volumes_mm3[body] += (products[0] + products[1] + products[2]) / 6;
  }
}

void EnclosedVolume::gradient(const PaddedVectors& x, PaddedVectors& gradient) const {
  std::fill(gradient.begin(), gradient.end(), PaddedVector::Zero());
  const Double4* at = as_double4(x.data());
  Double4* sum = as_double4(gradient.data());
  for (const BodyFace& f : faces_) {
    const Double4 origin = *as_double4(&bodies_[f.body].origin);
    const auto [i, j, k] = f.slots;
    const Double4 a = at[i] - origin, b = at[j] - origin, c = at[k] - origin;
    sum[i] += cross(b, c) / 6;
    sum[j] += cross(c, a) / 6;
    sum[k] += cross(a, b) / 6;
  }
  std::fill(gradient.begin() + static_cast<std::ptrdiff_t>(free_count_), gradient.end(),
            PaddedVector::Zero());
}

namespace {

constexpr double kNoSoftness = 1e-300;
// Of a body's size: the volume is linearised about the shape that a step starts from, and a
// pressure that moves its skin farther than this tells nothing of the volume there. Taken at its
// word it may swell the body, be answered by a larger one in the next round, and so on without end.
// What is left is for the next steps.
constexpr double kLinearWithin = 0.5;

}  // namespace

BodyPressures::BodyPressures(const Tissue& tissue, EnclosedVolume volume)
    : tissue_(tissue),
      volume_(std::move(volume)),
      gradient_(tissue.size(), PaddedVector::Zero()),
      response_(tissue.size(), PaddedVector::Zero()),
      pressure_(volume_.bodies().size(), 0.0),
      softness_(pressure_),
      most_pressure_(pressure_),
      volume_gap_(pressure_) {}

void BodyPressures::reset() { std::fill(pressure_.begin(), pressure_.end(), 0.0); }

void BodyPressures::begin_step(const PaddedVectors& x_start) {
  if (pressure_.empty()) return;
  volume_.gradient(x_start, gradient_);
  response_ = gradient_;
  response_due_ = true;
}

void BodyPressures::solve_along(PaddedVector* rows) {
  if (!response_due_) return tissue_.factor().solve_points(rows);
  tissue_.factor().solve_points(rows, response_.data());
  response_due_ = false;
  measure_softness();
}

void BodyPressures::measure_softness() {
  for (std::size_t b = 0; b < softness_.size(); ++b) softness_[b] = volume_.bodies()[b].compliance;
  std::fill(most_pressure_.begin(), most_pressure_.end(), 0.0);
  for (std::uint32_t i = 0; i < tissue_.free_count(); ++i) {
    const std::uint32_t body = volume_.body_of_slot(i);
    if (body == EnclosedVolume::kNoBody) continue;
    softness_[body] += gradient_[i].dot(response_[i]);
    most_pressure_[body] = std::max(most_pressure_[body], response_[i].squaredNorm());
  }
  for (std::size_t b = 0; b < softness_.size(); ++b) {
    const double farthest = std::sqrt(most_pressure_[b]);  // mm per unit of pressure
    const double size_mm = std::cbrt(std::abs(volume_.bodies()[b].rest_mm3));
    most_pressure_[b] =
        farthest > 0 ? kLinearWithin * size_mm / farthest : std::numeric_limits<double>::infinity();
  }
}

bool BodyPressures::acts(std::uint32_t body) const { return softness_[body] > kNoSoftness; }

double BodyPressures::close(std::uint32_t body, double gap_mm3) {
  const double most = most_pressure_[body], before = pressure_[body];
  pressure_[body] = std::clamp(before + gap_mm3 / softness_[body], -most, most);
  return pressure_[body] - before;
}

void BodyPressures::measure_gaps(const PaddedVectors& x_free, const PaddedVectors& x) {
  volume_.measure(x, volumes_);
  for (std::size_t b = 0; b < volumes_.size(); ++b) {
    volume_gap_[b] = volume_.bodies()[b].rest_mm3 - volumes_[b];
  }
  const Double4* gradient = as_double4(gradient_.data());
  const Double4* free = as_double4(x_free.data());
  const Double4* at = as_double4(x.data());
  const auto count = static_cast<std::uint32_t>(tissue_.free_count());
  for (std::uint32_t i = 0; i < count;) {  // by runs of one body
    const std::uint32_t body = volume_.body_of_slot(i);
    Double4 products{};
    for (; i < count && volume_.body_of_slot(i) == body; ++i)
      products += gradient[i] * (free[i] - at[i]);
    if (body != EnclosedVolume::kNoBody)
      volume_gap_[body] -= products[0] + products[1] + products[2];
  }
}

void BodyPressures::move(const PaddedVectors& x_free, PaddedVectors& x) const {
  const Double4* from = as_double4(x_free.data());
  const Double4* swell = as_double4(response_.data());
  Double4* to = as_double4(x.data());
  for (std::uint32_t i = 0; i < tissue_.moving_count(); ++i) {
    const std::uint32_t body = volume_.body_of_slot(i);
    to[i] = body == EnclosedVolume::kNoBody ? from[i] : from[i] + pressure_[body] * swell[i];
  }
}

double BodyPressures::energy() const {
  double twice = 0;
  for (std::size_t b = 0; b < pressure_.size(); ++b) {
    twice += volume_.bodies()[b].compliance * pressure_[b] * pressure_[b];
  }
  return twice / 2;
}

double BodyPressures::volume_error(const PaddedVectors& x) {
  if (pressure_.empty()) return 0;
  volume_.measure(x, volumes_);
  double largest = 0;
  for (std::size_t b = 0; b < volumes_.size(); ++b) {
    const auto& body = volume_.bodies()[b];
    if (body.rest_mm3 == 0 || !acts(static_cast<std::uint32_t>(b))) continue;
    const double error = volumes_[b] + body.compliance * pressure_[b] - body.rest_mm3;
    largest = std::max(largest, std::abs(error / body.rest_mm3));
  }
  return largest;
}

}  // namespace organbake::deform
