// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What place_cameras() and coverage are made of: how cameras frame an organ, what they see of it,
// and how few of them see enough.

#include <Eigen/Core>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

// How cameras frame an organ: all look at the centre of its bounds and hold it whole.
class OrganFrame {
 public:
  // Of the vertices that faces use. Throws BadDataError for a surface without (finite) extent.
  explicit OrganFrame(const TriangleMesh& surface);

  const Eigen::Vector3d& center_mm() const { return center_; }

  // The least common distance of cameras in these directions at which every vertex lies inside
  // every map.
  double common_distance_mm(const std::vector<Eigen::Vector3d>& directions,
                            const PlacementOptions& options, const RunContext& context) const;

  // The camera in a direction, its focal length raised until the organ fills its map; unnamed.
  PosedCamera camera(const Eigen::Vector3d& direction, double distance_mm,
                     const PlacementOptions& options) const;

 private:
  Eigen::Vector3d center_;
  std::vector<Eigen::Vector3d> points_;  // about the centre
  double radius_ = 0;
};

// `count` unit directions spread evenly over the cap within `half_angle_rad` (0…π) of an axis,
// the first on the axis (unless two or three share a cap of less than a quarter turn: those all
// stand on its rim). They start on a Fibonacci spiral and repel each other with the energy Σ 1/r²
// until they rest (Thomson's problem, with the cap's rim as a wall): four all round make a
// tetrahedron, six an octahedron, eight a square antiprism. Rolled about the axis so that the
// first one's nearest neighbour lies beside it, level with the world's z. Always the same.
std::vector<Eigen::Vector3d> spread_directions(int count, const Eigen::Vector3d& axis,
                                               double half_angle_rad);

// About how far apart neighbours are when `count` share the cap evenly.
double even_spacing_rad(std::size_t count, double half_angle_rad);

// Many unit directions over the same cap at once, on a Fibonacci spiral: even, not at rest. Those
// `on_rim` begin on the axis and end with a ring along the cap's rim (more than `count` in all);
// the others keep half a step off both, so that the two share no direction.
enum class LatticeKind { on_rim, off_rim };
std::vector<Eigen::Vector3d> lattice_directions(int count, const Eigen::Vector3d& axis,
                                                double half_angle_rad, LatticeKind lattice);

// The polyhedron { x : directions_i · x ≤ 1 } ∩ [−box, box]³.
struct PlanePolyhedron {
  struct Vertex {
    Eigen::Vector3d position;
    std::vector<std::uint32_t> planes;  // of the directions through it, increasing
    bool on_box = false;
  };
  std::vector<Vertex> vertices;
  TriangleMesh surface;  // outward, facets fanned
};

// Exact in what meets where (CGAL); vertices in the order of their places. The box is a power of
// two above 1: its inverse is then exact, too.
PlanePolyhedron intersect_view_planes(const std::vector<Eigen::Vector3d>& directions, double box);

// The cameras of given unit directions and distance, with their VPM.
Placement placement_of(const OrganFrame& organ, const std::vector<Eigen::Vector3d>& directions,
                       double distance_mm, const PlacementOptions& options);

// The VPM of given directions at one common distance; bounded by a box when the cameras do not
// surround the centre; vertices of more than three planes are fanned from their lowest camera.
// Fills placement.manifold and placement.manifold_surface. Triangles run counter-clockwise seen
// from outside, start at their lowest camera and are sorted; there are none for fewer than three
// cameras or for cameras that all lie in one plane with the centre. Throws BadDataError when an
// eye is at the centre, not finite, or in the same direction as another.
void build_view_manifold(const Eigen::Vector3d& center, const std::vector<Eigen::Vector3d>& eyes,
                         Placement& placement);

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

// What a set of cameras must do: at least `samples` samples seen by at least `overlap` of them.
struct CoverGoal {
  std::size_t samples = 0;
  int overlap = 2;
};

// Candidates, each by the samples that it sees.
using CandidateVisibility = std::vector<SampleBits>;

struct ChosenCover {
  std::vector<std::uint32_t> chosen;  // candidates, increasing
  std::size_t covered = 0;            // samples seen by at least goal.overlap of them
};

// Adds to a start always what gains most next, up to `most` candidates; fewer samples than the goal
// when they don't do. Deterministic.
[[nodiscard]] ChosenCover greedy_cover(const CandidateVisibility& seen, ChosenCover start,
                                       const CoverGoal& goal, std::size_t most);

struct Annealing {
  std::size_t moves = 1'000'000;
  // In units of one chosen candidate's share of what the goal lets go: a move by which so much more
  // is lacking is accepted one time in e, at first and in the end.
  double hot = 0.25, cold = 0.05;
};
// The fewest candidates found that reach a goal, by simulated annealing (Kirkpatrick, Gelatt and
// Vecchi 1983): one chosen candidate goes and one that sees a lacking sample comes, worse choices
// accepted less and less often; where the goal is reached, the one that is missed least goes for
// good. Where it is not, the start's number of candidates with the most samples covered.
// Deterministic. Throws CancelledError.
[[nodiscard]] ChosenCover annealed_cover(const CandidateVisibility& seen, const ChosenCover& start,
                                         const CoverGoal& goal, const Annealing& annealing,
                                         const RunContext& context = {});

// As many cameras as a coverage may take.
inline constexpr std::size_t kMostCoverCameras = 256;

// What cameras are chosen by: an organ, the region that its viewers are in, where cameras may stand
// for them, and what they see from there, all at one common distance. Cameras are named by their
// directions (organ's centre → eye, unit).
class CoverScene {
 public:
  using Directions = std::vector<Eigen::Vector3d>;

  // The faces look outward; options.coverage is given. All outlive the scene.
  CoverScene(const TriangleMesh& surface, const OrganFrame& organ, const PlacementOptions& options,
             const RunContext& context);

  const TriangleMesh& surface() const { return surface_; }
  const CoverageGoal& goal() const { return *options_.coverage; }
  const RunContext& context() const { return context_; }

  // Evenly over the region: where viewers may be.
  Directions views(int count) const;
  // Where cameras may stand: so many evenly over the region and a ring along its rim (narrow dents
  // show themselves there only), and half as many beyond it.
  Directions stands(int count) const;
  bool may_stand(const Eigen::Vector3d& direction) const;
  // Between neighbours of so many cameras that share the room they have evenly.
  double spacing_rad(std::size_t count) const;
  Eigen::Vector3d eye_mm(const Eigen::Vector3d& direction) const;

  SurfaceSamples samples(std::size_t count, std::uint64_t seed) const;
  // Seen well, as CoverageGoal says: by each camera, and from anywhere in the region.
  std::vector<SampleBits> seen_well(const Directions& cameras, const SurfaceSamples& samples,
                                    const SampleBits* among) const;
  SampleBits reachable(const SurfaceSamples& samples) const;
  // Of the samples `among`, by number: those that fewer than goal().overlap of the cameras see
  // well.
  std::vector<std::uint32_t> missed(const Directions& cameras, const SurfaceSamples& samples,
                                    const SampleBits& among) const;
  // Seen at any angle.
  std::vector<SampleBits> visible(const Directions& cameras, const SurfaceSamples& samples) const;

  // The cameras, farther off where the organ would not fit their maps.
  Placement placed(const Directions& cameras) const;

 private:
  std::vector<Eye> eyes(const Directions& directions, double texel_mm) const;
  SightLimits well() const { return {kLeastSeenCosine, goal().texel_mm}; }

  const TriangleMesh& surface_;
  const OrganFrame& organ_;
  const PlacementOptions& options_;
  const RunContext& context_;
  ViewingCone region_, stand_;
  Sight sight_;
  double distance_mm_;
};

// Samples of what is reachable, and the working ones among them that cameras are chosen by: all, on
// a smooth surface. On a deeply folded one a few places decide, and each needs many samples: there
// are many times as many, and those work that are hardest to see. The rest is seen often enough by
// whatever cameras show these; what is not, joins.
class SamplePool {
 public:
  using Directions = CoverScene::Directions;

  // Some of the candidates judge how hard a sample is to see.
  SamplePool(const CoverScene& scene, const Directions& candidates, std::size_t working,
             std::uint64_t seed);

  bool folded() const { return folded_; }
  // Several times as many samples where some are hard to see: cameras that were chosen by few have
  // been made for just these. Elsewhere one sample stands for as many.
  void refine();

  std::size_t reachable() const;
  const SurfaceSamples& working() const { return working_samples_; }

  // Reachable ones that the cameras miss, by number; as often as the surface that they stand for.
  std::vector<std::uint32_t> missed_by(const Directions& cameras) const;
  // Makes samples working ones; returns those that were not yet, the last of the working ones now.
  SurfaceSamples join(const std::vector<std::uint32_t>& samples);

 private:
  using Eased = std::pair<int, std::uint32_t>;  // judges that see it, sample
  void draw(std::size_t count, std::uint64_t seed);
  std::vector<Eased> judged() const;
  std::vector<bool> hard_faces() const;
  void work_with_hardest();

  const CoverScene& scene_;
  Directions judges_;
  std::uint64_t seed_;
  SurfaceSamples samples_;
  std::vector<std::uint32_t> stands_for_;  // so many
  SampleBits reachable_, is_working_;
  std::vector<Eased> hardest_;  // that the pool began to work with
  SurfaceSamples working_samples_;
  bool folded_ = false;
};

// The fewest cameras found that reach options.coverage, chosen among even directions over the
// viewing region and a little beyond it (kBeyondRegion_rad) at one common distance, then moved
// between them; where views over the VPM would still miss more than 0.1 % of what they show,
// on average, cameras are added at the worst of them. Reached is what independent samples say. When
// the goal is out of reach (or of 256 cameras) the best is kept, with a warning. Throws
// BadDataError when no view of the region shows anything.
Placement cover_with_cameras(const TriangleMesh& surface, const OrganFrame& organ,
                             const PlacementOptions& options, const RunContext& context);

}  // namespace organbake
