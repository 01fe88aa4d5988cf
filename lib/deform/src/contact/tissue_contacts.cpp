// SPDX-License-Identifier: Apache-2.0
#include "contact/tissue_contacts.h"

#include <algorithm>
#include <cmath>

#include "organbake/geometry/prism.h"
#include "organbake/geometry/shell_map.h"

namespace organbake::deform {
namespace {

// How near faces count as neighbours, of the largest organ's diagonal, and how far apart probes
// stand, of their own organ's.
constexpr double kMargin = 0.02;
constexpr double kSpacing = 0.06;
constexpr int kMostPerEdge = 6;
constexpr double kDeeperBetween = 1.25;  // of an overlap: between the points that feel
constexpr double kOpposed = -0.2;        // skin that meets skin looks against it
constexpr double kFound_mm = 1e-6;       // a prism that is folded flat has roots that mean nothing

double longest_edge(const Face& f, const PaddedVectors& x) {
  return std::max(
      {(x[f[0]] - x[f[1]]).norm(), (x[f[1]] - x[f[2]]).norm(), (x[f[2]] - x[f[0]]).norm()});
}

bool farther_than(const PaddedVectors& a, const PaddedVectors& b, double limit) {
  const Double4* p = as_double4(a.data());
  const Double4* q = as_double4(b.data());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Double4 d = p[i] - q[i];
    if (!(dot(d, d) <= limit * limit)) return true;
  }
  return false;
}

}  // namespace

TissueContacts::TissueContacts(Skin& skin, const Tissue& tissue, const ContactSearch& search,
                               double diagonal_mm)
    : skin_(skin),
      tissue_(tissue),
      search_(search),
      margin_mm_(kMargin * diagonal_mm),
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
  organ_count_ = organs.size();
  first_probe_.push_back(static_cast<std::uint32_t>(probes_.size()));
  probed_.resize(probes_.size());
  own_.resize(probes_.size());
}

void TissueContacts::measure_rest() {
  skin_.pose(tissue_.rest());
  in_front_.assign(probes_.size(), 0);
  released_.assign(probes_.size(), 0);
  overlap_mm_.assign(organ_count_ * organ_count_, 0.0);
  probe_all();
  see_fronts();
  // What lies below another organ's skin came from its front.
  for (const std::uint32_t k : touched_) {
    if (probed_[k].depth_mm <= 0 ||
        tissue_.organ_of_face(own_[k].at.face) == tissue_.organ_of_face(probed_[k].other.at.face))
      continue;
    const std::uint32_t own = own_[k].at.face, other = probed_[k].other.at.face;
    const double deeper =
        std::max(overlap_mm_[organ_pair(own, other)], kDeeperBetween * probed_[k].depth_mm);
    overlap_mm_[organ_pair(own, other)] = overlap_mm_[organ_pair(other, own)] = deeper;
    in_front_[k] = 1;
  }
  in_front_at_rest_ = in_front_;
}

void TissueContacts::reset() {
  in_front_ = in_front_at_rest_;
  released_.assign(probes_.size(), 0);
  x_of_pairs_.clear();
  x_probed_.clear();
}

void TissueContacts::go_back_to(const Sides& sides) {
  in_front_ = sides.in_front;
  released_ = sides.released;
  x_probed_.clear();
}

void TissueContacts::untangle(std::vector<Contact>& contacts) {
  for (const Contact& c : contacts) {
    if (const OnTissue* other = c.as<OnTissue>()) released_[other->probe] = 1;
  }
  std::erase_if(contacts, [](const Contact& c) { return c.of_tissue(); });
  x_probed_.clear();
}

// Pairs hold as long as nothing has moved by half of how near they were sought.
void TissueContacts::find_pairs() {
  const PaddedVectors& x = skin_.shape();
  if (!x_of_pairs_.empty() && !farther_than(x, x_of_pairs_, margin_mm_ / 2)) return;
  tree_.find_pairs(margin_mm_, pairs_);
  x_of_pairs_ = x;
}

void TissueContacts::probe_all() {
  find_pairs();
  for (const std::uint32_t k : touched_) probed_[k].found = false;
  touched_.clear();
  has_own_.assign(probes_.size(), 0);
  for (const auto& [f, g] : pairs_) probe(f, g), probe(g, f);
  std::sort(touched_.begin(), touched_.end());
}

// The shell over a face as it lies now, as far as its skin and a margin about it reach.
struct TissueContacts::Prism {
  Prism(Skin& skin, std::uint32_t face, double margin_mm)
      : face(face),
        farthest_mm(skin.tallest_mm(face) + margin_mm),
        matrix(matrix_of(skin.frame(face))),
        bounds(prism_bounds(matrix, skin.lowest_mm(face) - margin_mm,
                            skin.highest_mm(face) + margin_mm)),
        cubic(matrix) {}

  // The smallest height of a point in the prism; false outside.
  bool find(const Eigen::Vector3d& point, ShellBinding& found) const {
    if (!bounds.holds(point)) return false;
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

// Each probe keeps the skin that is nearest to it.
void TissueContacts::probe(std::uint32_t face, std::uint32_t other) {
  const Prism prism(skin_, other, margin_mm_);
  for (std::uint32_t k = first_probe_[face]; k < first_probe_[face + 1]; ++k) {
    if (!has_own_[k]) own_[k] = skin_.hit(probes_[k], PaddedVector::Zero()), has_own_[k] = 1;
    const SkinHit& own = own_[k];
    ShellBinding place;
    if (!prism.find(own.point.head<3>(), place)) continue;
    const SkinHit hit = skin_.hit(skin_.point_over(other, place.b1, place.b2), own.point);
    if (own.normal.dot(hit.normal) > kOpposed) continue;
    Probed& probed = probed_[k];
    if (probed.found && probed.other.distance_mm <= hit.distance_mm) continue;
    if (!probed.found) touched_.push_back(k);
    probed = {hit, (hit.point - own.point).dot(hit.normal), true, false};
  }
}

// Skin that is not felt any more has to come from the front again.
void TissueContacts::see_fronts() {
  for (std::uint32_t k = 0; k < probed_.size(); ++k) {
    const Probed& probed = probed_[k];
    if (!probed.found) {
      in_front_[k] = released_[k] = 0;
    } else if (released_[k]) {
      in_front_[k] = 0;
    } else if (probed.depth_mm <= 0) {
      in_front_[k] = 1;
    }
  }
}

// How much deeper than it may be.
double TissueContacts::sunk_mm(std::uint32_t probe) const {
  return in_front_[probe] ? probed_[probe].depth_mm - allowed_mm(probe) : 0;
}

double TissueContacts::allowed_mm(std::uint32_t probe) const {
  return overlap_mm_[organ_pair(probes_[probe].face, probed_[probe].other.at.face)];
}

// Of all that could sink.
double TissueContacts::clearance_mm() const {
  double least = margin_mm_;
  for (const std::uint32_t k : touched_) {
    if (in_front_[k]) least = std::min(least, -sunk_mm(k));
  }
  return least;
}

double TissueContacts::refresh(std::vector<Contact>& contacts) {
  // Skin moves farther than the proxy's vertices where its normals turn.
  constexpr double kSafe = 0.25;
  if (!x_probed_.empty() && !farther_than(skin_.shape(), x_probed_, kSafe * clearance_mm_))
    return 0;
  x_probed_.clear();
  probe_all();
  see_fronts();
  std::erase_if(contacts, [&](const Contact& c) {
    const OnTissue* other = c.as<OnTissue>();
    return other && !probed_[other->probe].found;
  });
  double deepest = 0;
  std::size_t count = 0;
  for (Contact& c : contacts) {
    const OnTissue* other = c.as<OnTissue>();
    if (!other) continue;
    ++count;
    update(c);
    probed_[other->probe].has_contact = true;
    deepest = std::max(deepest, sunk_mm(other->probe));
  }
  std::vector<std::uint32_t> sunk;
  for (const std::uint32_t k : touched_) {
    if (!probed_[k].has_contact && sunk_mm(k) > 0) sunk.push_back(k);
  }
  std::stable_sort(sunk.begin(), sunk.end(),
                   [&](std::uint32_t p, std::uint32_t q) { return sunk_mm(p) > sunk_mm(q); });
  for (const std::uint32_t k : sunk) {
    Contact made;
    made.kind = OnTissue{k};
    made.at = probes_[k];
    update(made);
    if (made.response.free_share == 0) continue;  // neither side can give way
    deepest = std::max(deepest, sunk_mm(k));
    if (count++ < kMost) contacts.push_back(made);
  }
  if (count == 0 && (clearance_mm_ = clearance_mm()) > 0) x_probed_ = skin_.shape();
  return deepest;
}

// The constrained point is the probe relative to the skin below which it must not sink.
void TissueContacts::update(Contact& contact) const {
  const std::uint32_t probe = std::get<OnTissue>(contact.kind).probe;
  const SkinPoint& at = probes_[probe];
  const Probed& probed = probed_[probe];
  contact.point = own_[probe].point;
  contact.normal = probed.other.normal;
  contact.target = -allowed_mm(probe) * probed.other.normal;
  contact.tip_motion.setZero();
  contact.response = against(search_.response_of(at), search_.response_of(probed.other.at));
  contact.anchored_at = search_.anchored(at, own_[probe].point) -
                        search_.anchored(probed.other.at, probed.other.point);
}

}  // namespace organbake::deform
