// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

// Which of a number of surface samples, a bit each: counting what two sets share is most of the
// work of choosing cameras.
class SampleBits {
 public:
  static constexpr std::size_t kWordBits = 64;

  explicit SampleBits(std::size_t size = 0)
      : size_(size), words_((size + kWordBits - 1) / kWordBits) {}

  std::size_t size() const { return size_; }
  void set(std::size_t i) { words_[i / kWordBits] |= std::uint64_t{1} << (i % kWordBits); }
  bool test(std::size_t i) const { return words_[i / kWordBits] >> (i % kWordBits) & 1; }
  std::span<std::uint64_t> words() { return words_; }
  std::span<const std::uint64_t> words() const { return words_; }

  std::size_t count() const {
    std::size_t sum = 0;
    for (const std::uint64_t word : words_) sum += std::popcount(word);
    return sum;
  }
  // Calls take(i) for each that is set, in order.
  template <class Take>
  void for_each(const Take& take) const {
    for (std::size_t w = 0; w < words_.size(); ++w) {
      for (std::uint64_t bits = words_[w]; bits; bits &= bits - 1)
        take(w * kWordBits + static_cast<std::size_t>(std::countr_zero(bits)));
    }
  }
  void append(const SampleBits& other) {
    const std::size_t first = size_;
    size_ += other.size_;
    words_.resize((size_ + kWordBits - 1) / kWordBits);
    other.for_each([&](std::size_t i) { set(first + i); });
  }
  SampleBits& operator|=(const SampleBits& other) {
    for (std::size_t w = 0; w < words_.size(); ++w) words_[w] |= other.words_[w];
    return *this;
  }
  SampleBits& operator&=(const SampleBits& other) {
    for (std::size_t w = 0; w < words_.size(); ++w) words_[w] &= other.words_[w];
    return *this;
  }

 private:
  std::size_t size_;
  std::vector<std::uint64_t> words_;
};

inline std::size_t count_common(const SampleBits& a, const SampleBits& b) {
  std::size_t sum = 0;
  for (std::size_t w = 0; w < a.words().size(); ++w) {
    sum += std::popcount(a.words()[w] & b.words()[w]);
  }
  return sum;
}

// How many of the sets hold a sample, counted up to `most`.
inline int times_in(const std::vector<SampleBits>& sets, std::size_t sample, int most) {
  int times = 0;
  for (std::size_t k = 0; k < sets.size() && times < most; ++k) times += sets[k].test(sample);
  return times;
}

// Points spread evenly by area over a surface (world mm), neighbours in space near each other in
// the list: rays to them are then coherent.
struct SurfaceSamples {
  std::vector<std::uint32_t> faces;
  std::vector<Eigen::Vector3d> weights;  // of the faces' corners, sum 1
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;  // unit, of the faces

  std::size_t size() const { return points.size(); }
};

void append_sample(const SurfaceSamples& from, std::size_t i, SurfaceSamples& to);

// One random stream a sample. Throws BadDataError when the surface has no (finite) area.
SurfaceSamples sample_surface(const TriangleMesh& surface, std::size_t count, std::uint64_t seed);

// Where somebody looks from. The last two are asked only where texels are limited.
struct Eye {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d forward = Eigen::Vector3d::UnitZ();  // unit
  double focal_px = 0;
};

// The longest side of a texel's footprint on a surface at `point` with a unit normal: at the planar
// depth z it is z/f wide, and longer by the slant. Not positive behind the eye; `point` is seen
// from the front.
double texel_mm(const Eye& eye, const Eigen::Vector3d& point, const Eigen::Vector3d& normal);

// What counts as seen besides a free line of sight.
struct SightLimits {
  double least_cosine = 0;  // between the normal and the way to the eye, 0…1; always from the front
  double texel_mm = 0;      // longest side of a texel's footprint on the surface; 0 = any
};

// Lines of sight to samples of one surface. Queries are const and thread-safe.
class Sight {
 public:
  // Throws BadDataError as RayScene does.
  explicit Sight(const TriangleMesh& surface);

  // Which of the samples one eye sees; all of them may be asked, or those of `among`.
  SampleBits seen_from(const Eye& eye, const SurfaceSamples& samples, const SightLimits& limits,
                       const SampleBits* among = nullptr) const;
  // For each of several eyes, in parallel.
  std::vector<SampleBits> seen_from_each(const std::vector<Eye>& eyes,
                                         const SurfaceSamples& samples, const SightLimits& limits,
                                         const SampleBits* among = nullptr) const;
  // Which samples at least one of the eyes sees: far cheaper than asking for each, because a sample
  // is asked until it is seen.
  SampleBits seen_from_any(const std::vector<Eye>& eyes, const SurfaceSamples& samples,
                           const SightLimits& limits) const;

 private:
  RayScene scene_;
  double step_back_mm_;  // how far before a sample its line of sight ends
};

// `seen[v]`: samples visible from views_mm[v], at any angle. `kept[c]`: samples that camera c has.
// `samples` as they lie in the views (poked, perhaps); cameras may have been at rest.
ViewCertificate certify_views(const ViewManifold& manifold, const std::vector<SampleBits>& kept,
                              const std::vector<Eigen::Vector3d>& views_mm,
                              const std::vector<SampleBits>& seen, const SurfaceSamples& samples);

// The surface, a colour a vertex by how many of the cameras show it well: red = none, yellow = one,
// green = two, blue = three or more; grey = none of the region's views does.
TriangleMesh painted_by_cameras(const TriangleMesh& surface, const Sight& sight,
                                const std::vector<Eye>& cameras, const std::vector<Eye>& region,
                                const SightLimits& well);

}  // namespace organbake
