// SPDX-License-Identifier: Apache-2.0
// The points that feel for skin near them: spread over every face once, each keeps the skin that is
// nearest to it among the faces that may be near, by the prisms of their shells in the present
// pose. All are probed anew when something has moved so far that others than those watched may
// sink.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "contact/contact_search.h"
#include "organbake/geometry/prism.h"
#include "organbake/geometry/shell.h"

namespace organbake::deform {
namespace {

// How near faces count as neighbours, of the largest organ's diagonal, and how far apart probes
// stand, of their own organ's.
constexpr double kMargin = 0.02;
constexpr double kSpacing = 0.06;
constexpr int kMostPerEdge = 6;
constexpr double kLonger = 1 + 1e-9;     // a distance that is longer, whatever is rounded
constexpr double kCrowd = 0.03;          // of the diagonal: contacts beside cuts stand no closer
constexpr double kDeeperBetween = 1.25;  // of an overlap: between the points that feel
constexpr double kOpposed = -0.2;        // skin that meets skin looks against it
constexpr double kFound_mm = 1e-6;       // a prism that is folded flat has roots that mean nothing

constexpr std::uint32_t kNoPrism = ~0u;

double longest_edge(const Face& f, const PaddedVectors& x) {
  return std::max(
      {(x[f[0]] - x[f[1]]).norm(), (x[f[1]] - x[f[2]]).norm(), (x[f[2]] - x[f[0]]).norm()});
}

}  // namespace

// The shell over a face as it lies now, as far as its skin and a margin about it reach.
struct TissueContacts::Prism {
  Prism(Skin& skin, std::uint32_t face, double margin_mm)
      : face(face),
        farthest_mm(skin.tallest_mm(face) + margin_mm),
        matrix(matrix_of(skin.frame(face))),
        bounds(prism_bounds(matrix, skin.lowest_mm(face) - margin_mm,
                            skin.highest_mm(face) + margin_mm)),
        cubic(matrix) {}

  // The smallest height of a point in the prism, which its bounds hold; false outside.
  bool find(const Eigen::Vector3d& point, ShellBinding& found) const {
    const PrismCubic::Roots roots = cubic.heights(point, farthest_mm);
    for (int i = 0; i < roots.count; ++i) {
      const Eigen::Vector2d b = barycentric_at_height(matrix, roots.heights[i], point);
      if (b.x() < 0 || b.y() < 0 || b.x() + b.y() > 1) continue;
      found = {face, b.x(), b.y(), roots.heights[i]};
      return (shell_point(matrix, b.x(), b.y(), found.height_mm) - point).norm() < kFound_mm;
    }
    return false;
  }

  static ShellMatrix matrix_of(const SkinFace& frame) {
    const Double4 columns[6] = {frame.origin, frame.along1,  frame.along2,
                                frame.normal, frame.normal1, frame.normal2};
    ShellMatrix matrix = ShellMatrix::Zero();
    for (int c = 0; c < 6; ++c) {
      for (int i = 0; i < 3; ++i) matrix(i, c) = columns[c][i];
    }
    return matrix;
  }

  std::uint32_t face;
  double farthest_mm;
  ShellMatrix matrix;
  PrismBounds bounds;
  PrismCubic cubic;
};

TissueContacts::TissueContacts(Skin& skin, const Tissue& tissue, const ContactSearch& search,
                               double diagonal_mm)
    : skin_(skin),
      tissue_(tissue),
      search_(search),
      margin_mm_(kMargin * diagonal_mm),
      crowd_mm_(kCrowd * diagonal_mm),
      tree_(tissue, skin) {
  spread_probes();
  measure_rest();
}

// At the middles of the triangles that each face is cut into: never on an edge, where two faces
// would feel the same.
void TissueContacts::spread_probes() {
  std::vector<Bounds> organs;
  for (std::size_t slot = 0; slot < tissue_.size(); ++slot) {
    const std::uint32_t organ = tissue_.organ_of_slot()[slot];
    if (organ >= organs.size()) organs.resize(organ + 1);
    organs[organ].add(tissue_.rest()[slot].head<3>());
  }
  for (std::uint32_t f = 0; f < tissue_.faces().size(); ++f) {
    first_probe_.push_back(static_cast<std::uint32_t>(probes_.size()));
    const double spacing_mm = kSpacing * organs[tissue_.organ_of_face(f)].diagonal();
    const double pieces = longest_edge(tissue_.faces()[f], tissue_.rest()) / spacing_mm;
    const int n = static_cast<int>(std::clamp(std::ceil(pieces), 1.0, double(kMostPerEdge)));
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        probes_.push_back(skin_.point_over(f, (i + 1. / 3) / n, (j + 1. / 3) / n));
        if (i + j + 2 > n) continue;
        probes_.push_back(skin_.point_over(f, (i + 2. / 3) / n, (j + 2. / 3) / n));
      }
    }
  }
  first_probe_.push_back(static_cast<std::uint32_t>(probes_.size()));
  probed_.resize(probes_.size());
  own_.resize(probes_.size());
  outside_in_step_.assign(probes_.size(), 0);
  prism_number_.assign(tissue_.faces().size(), kNoPrism);
  piece_faces_.resize(tissue_.pieces().size());
  for (std::uint32_t f = 0; f < tissue_.faces().size(); ++f)
    piece_faces_[tissue_.piece_of_face(f)].push_back(f);
}

void TissueContacts::measure_rest() {
  skin_.pose(tissue_.rest());
  begin_step();
  in_front_.assign(probes_.size(), 0);
  released_.assign(probes_.size(), 0);
  rest_depth_mm_.assign(probes_.size(), 0.0);
  overlap_mm_.assign(tissue_.pieces().size() * tissue_.pieces().size(), 0.0);
  probe_all();
  // What lies below another organ's skin came from its front.
  for (const std::uint32_t k : touched_) {
    const std::uint32_t own = own_[k].at.face, other = probed_[k].other.at.face;
    if (probed_[k].depth_mm <= 0) continue;
    if (tissue_.organ_of_face(own) == tissue_.organ_of_face(other)) {
      // Where cuts cross, shreds of their walls lie in each other from the first.
      if (in_front_[k] && between_pieces(own, other)) rest_depth_mm_[k] = probed_[k].depth_mm;
      continue;
    }
    const double deeper =
        std::max(overlap_mm_[piece_pair(own, other)], kDeeperBetween * probed_[k].depth_mm);
    overlap_mm_[piece_pair(own, other)] = overlap_mm_[piece_pair(other, own)] = deeper;
    in_front_[k] = 1;
  }
  in_front_at_rest_ = in_front_;
}

// Pairs hold as long as nothing has moved by half of how near they were sought.
void TissueContacts::find_pairs() {
  const PaddedVectors& x = skin_.shape();
  if (!x_of_pairs_.empty() && largest_distance(x, x_of_pairs_) <= margin_mm_ / 2) return;
  x_of_pairs_ = x;
  list_pairs();
}

// In the skin's pose; and by face those beside it, in the order of the pairs.
void TissueContacts::list_pairs() {
  tree_.find_pairs(margin_mm_, pairs_);
  first_beside_.assign(tissue_.faces().size() + 1, 0);
  for (const auto& [f, g] : pairs_) ++first_beside_[f + 1], ++first_beside_[g + 1];
  std::partial_sum(first_beside_.begin(), first_beside_.end(), first_beside_.begin());
  beside_.resize(first_beside_.back());
  std::vector<std::uint32_t> next(first_beside_.begin(), first_beside_.end() - 1);
  for (const auto& [f, g] : pairs_) beside_[next[f]++] = g, beside_[next[g]++] = f;
}

void TissueContacts::be_restored() {
  for (Probed& probed : probed_) probed.found = false;
  touched_ = watched_;
  if (x_of_pairs_.empty()) return;
  skin_.pose(x_of_pairs_);
  list_pairs();
  if (x_probed_.empty()) return;
  skin_.pose(x_probed_);
  forget_prisms();
  for (const std::uint32_t k : watched_) own_[k] = skin_.hit(probes_[k], PaddedVector::Zero());
  list_near_watched();
}

void TissueContacts::forget_prisms() {
  prisms_.clear();
  std::fill(prism_number_.begin(), prism_number_.end(), kNoPrism);
}

void TissueContacts::probe_all() {
  find_pairs();
  for (const std::uint32_t k : touched_) probed_[k].found = false;
  touched_.clear();
  balls_.assign(tissue_.faces().size(), ProbeBall{});
  forget_prisms();
  for (const auto& [f, g] : pairs_) probe(f, g), probe(g, f);
  std::sort(touched_.begin(), touched_.end());
  for (std::uint32_t k = 0; k < probed_.size(); ++k) see_front(k);
}

// Those alone that may sink before something has moved so far that all are probed again.
void TissueContacts::probe_watched() {
  forget_prisms();
  for (std::size_t w = 0; w < watched_.size(); ++w) {
    const std::uint32_t k = watched_[w];
    probed_[k].found = false;
    own_[k] = skin_.hit(probes_[k], PaddedVector::Zero());
    for (std::size_t n = first_near_[w]; n < first_near_[w + 1]; ++n) feel(k, prism_of(near_[n]));
    see_front(k);
  }
}

// Those faces in whose prisms watched probes may be before all are probed again.
void TissueContacts::list_near_watched() {
  first_near_.assign(1, 0);
  near_.clear();
  for (const std::uint32_t k : watched_) {
    const std::uint32_t face = probes_[k].face;
    for (std::uint32_t b = first_beside_[face]; b < first_beside_[face + 1]; ++b) {
      const PrismBounds& bounds = prism_of(beside_[b]).bounds;
      if (bounds.touches_sphere(own_[k].point.head<3>(), clearance_mm_ + bounds.slack))
        near_.push_back(beside_[b]);
    }
    first_near_.push_back(near_.size());
  }
}

TissueContacts::~TissueContacts() = default;

// Made once for each face in a pose, because a face meets many others.
const TissueContacts::Prism& TissueContacts::prism_of(std::uint32_t face) {
  std::uint32_t& number = prism_number_[face];
  if (number == kNoPrism) {
    number = static_cast<std::uint32_t>(prisms_.size());
    prisms_.emplace_back(skin_, face, margin_mm_);
  }
  return prisms_[number];
}

// Where a face's probes are in the pose, and the ball that holds them.
const TissueContacts::ProbeBall& TissueContacts::ball_of(std::uint32_t face) {
  ProbeBall& ball = balls_[face];
  if (ball.radius_mm >= 0) return ball;
  const std::uint32_t first = first_probe_[face], end = first_probe_[face + 1];
  Bounds bounds;
  for (std::uint32_t k = first; k < end; ++k) {
    own_[k] = skin_.hit(probes_[k], PaddedVector::Zero());
    bounds.add(own_[k].point.head<3>());
  }
  constexpr double kRounded_mm = 1e-6;
  ball = {bounds.center(), bounds.diagonal() / 2 + kRounded_mm};
  return ball;
}

// Each probe keeps the skin that is nearest to it.
void TissueContacts::probe(std::uint32_t face, std::uint32_t other) {
  const Prism& prism = prism_of(other);
  const ProbeBall& ball = ball_of(face);
  if (!prism.bounds.touches_sphere(ball.center, ball.radius_mm + prism.bounds.slack)) return;
  for (std::uint32_t k = first_probe_[face]; k < first_probe_[face + 1]; ++k)
    if (feel(k, prism)) touched_.push_back(k);
}

// Whether a probe is in a prism, and was in none before.
bool TissueContacts::feel(std::uint32_t k, const Prism& prism) {
  const SkinHit& own = own_[k];
  Probed& probed = probed_[k];
  const bool has_few_nodes = skin_.smooth(prism.face) && skin_.steps(prism.face) == 1;
  if (!prism.bounds.holds(own.point.head<3>())) return false;
  if (probed.found && has_few_nodes &&
      skin_.least_distance(prism.face, own.point) > kLonger * probed.other.distance_mm)
    return false;
  ShellBinding place;
  if (!prism.find(own.point.head<3>(), place)) return false;
  const SkinHit hit = skin_.hit(skin_.point_over(prism.face, place.b1, place.b2), own.point);
  if (own.normal.dot(hit.normal) > kOpposed) return false;
  if (probed.found && probed.other.distance_mm <= hit.distance_mm) return false;
  const bool is_first = !probed.found;
  probed = {hit, (hit.point - own.point).dot(hit.normal), true, false};
  return is_first;
}

// Skin that is not felt any more has to come from the front again.
void TissueContacts::see_front(std::uint32_t k) {
  const Probed& probed = probed_[k];
  if (!probed.found) {
    in_front_[k] = released_[k] = 0;
  } else if (released_[k]) {
    in_front_[k] = 0;
  } else if (probed.depth_mm <= touching_mm(k)) {
    in_front_[k] = 1;
  } else if (!in_front_[k] && between_pieces(probes_[k].face, probed.other.at.face)) {
    in_front_[k] = is_inside(k);
  }
}

}  // namespace organbake::deform
