// SPDX-License-Identifier: Apache-2.0
// States that another solver computes. They are taken from another program's memory after a check
// of their count, their values and whether they can be this organ's. A picture needs the proxy's
// positions alone, so they cost a copy; the player's own solver follows when it is next asked to
// step, with nodes that fit the vertices.
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/player/player.h"
#include "organbake/player/state_reader.h"

namespace organbake {
namespace {

const Face& corners_of(const Face& face) { return face; }
const auto& corners_of(const Tetrahedron& tetrahedron) { return tetrahedron.nodes; }

// Whether places may be those of a mesh that another program has deformed: told by its size, by
// where it lies, by edges of it, which tissue does not make several times as long on average, and
// by the affine map that fits best, which mirrors nothing. Wrong units, another mesh or another
// order of the vertices show there, and the message says which is likely.
class PlausiblePlaces {
 public:
  // elements: the mesh's faces or tetrahedra; what: "vertices" or "nodes", for messages.
  template <class Elements>
  PlausiblePlaces(const std::string& what, const std::vector<Eigen::Vector3d>& rest_mm,
                  const Elements& elements)
      : what_(what) {
    for (std::size_t e = 0; e < elements.size(); e += 1 + elements.size() / kEdges)
      edges_.push_back({corners_of(elements[e])[0], corners_of(elements[e])[1]});
    begin(rest_mm);
  }

  // Throws UsageError naming what is wrong. As many places as at rest; all finite.
  void check(const std::vector<Eigen::Vector3d>& now_mm) const;

 private:
  static constexpr std::size_t kEdges = 500;
  void begin(const std::vector<Eigen::Vector3d>& rest_mm);
  Eigen::Matrix3d spread_with(const std::vector<Eigen::Vector3d>& places_mm) const;
  bool are_mirrored(const std::vector<Eigen::Vector3d>& places_mm) const;
  double edges_mm(const std::vector<Eigen::Vector3d>& places_mm) const;  // their mean

  std::string what_;
  std::vector<std::array<std::uint32_t, 2>> edges_;
  Eigen::Vector3d center_mm_ = Eigen::Vector3d::Zero();
  double diagonal_mm_ = 0, edges_mm_ = 0;
  std::vector<Eigen::Vector3d> from_mean_mm_;                 // at rest
  Eigen::Matrix3d spread_inverse_ = Eigen::Matrix3d::Zero();  // of them; 0: they lie in a plane
};

constexpr double kFarthestDiagonals =
    10;  // diagonals from rest: the solver's own limit for a lost state

// Tissue tears before it is 2 or 3 times as long; places that are another mesh's have edges from
// anywhere to anywhere.
constexpr double kMostStretch = 4, kLeastStretch = 0.2;

// Of a sheet as thin as this, by its length, nothing says which way its normal points. A mirrored
// organ's map has the determinant −1 and explains where all of it lies; that of an organ which has
// collapsed, as springs without volume do, may turn over, too, but explains little.
constexpr double kFlat = 0.02, kMirrored = -0.2, kExplained = 0.95;

constexpr double kMetresStretch = 1e-3, kCentimetresStretch = 0.1;

Bounds box_of(const std::vector<Eigen::Vector3d>& places) {
  Bounds box;
  for (const Eigen::Vector3d& p : places) box.add(p);
  return box;
}

Eigen::Vector3d mean_of(const std::vector<Eigen::Vector3d>& places) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : places) mean += p / double(places.size());
  return mean;
}

// "; are they metres?" where their size says so.
std::string unit_question(double stretch) {
  const auto near = [stretch](double wanted) {
    return stretch > 0.6 * wanted && stretch < 1.7 * wanted;
  };
  if (near(kMetresStretch)) return "; are they in metres? It takes millimetres";
  if (near(kCentimetresStretch)) return "; are they in centimetres? It takes millimetres";
  return "; they are not of this organ, or not in millimetres";
}

void PlausiblePlaces::begin(const std::vector<Eigen::Vector3d>& rest_mm) {
  const Bounds box = box_of(rest_mm);
  center_mm_ = box.center();
  diagonal_mm_ = box.diagonal();
  edges_mm_ = edges_mm(rest_mm);
  const Eigen::Vector3d mean = mean_of(rest_mm);
  for (const Eigen::Vector3d& p : rest_mm) from_mean_mm_.push_back(p - mean);
  const Eigen::Matrix3d spread = spread_with(rest_mm);
  const double flattest = spread.selfadjointView<Eigen::Lower>().eigenvalues().x();
  if (flattest > kFlat * kFlat * spread.trace()) spread_inverse_ = spread.inverse();
}

// Σ place · (rest − mean)ᵀ; the places' own mean does not matter, since the other's sum is 0.
Eigen::Matrix3d PlausiblePlaces::spread_with(const std::vector<Eigen::Vector3d>& places_mm) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from_mean_mm_.size(); ++i)
    sum += (places_mm[i] - center_mm_) * from_mean_mm_[i].transpose();
  return sum;
}

bool PlausiblePlaces::are_mirrored(const std::vector<Eigen::Vector3d>& places_mm) const {
  const Eigen::Matrix3d spread = spread_with(places_mm), map = spread * spread_inverse_;
  if (!(map.determinant() < kMirrored)) return false;
  const Eigen::Vector3d mean = mean_of(places_mm);
  double all = 0;
  for (const Eigen::Vector3d& p : places_mm) all += (p - mean).squaredNorm();
  return (map * spread.transpose()).trace() > kExplained * all;
}

double PlausiblePlaces::edges_mm(const std::vector<Eigen::Vector3d>& places_mm) const {
  double sum = 0;
  for (const auto& [a, b] : edges_) sum += (places_mm[b] - places_mm[a]).norm();
  return sum / double(edges_.size());
}

void PlausiblePlaces::check(const std::vector<Eigen::Vector3d>& now_mm) const {
  const Bounds box = box_of(now_mm);
  const double size = box.diagonal() / diagonal_mm_, stretch = edges_mm(now_mm) / edges_mm_;
  if (!(size > kLeastStretch && size < kFarthestDiagonals)) {
    throw UsageError("the " + what_ + " span " + to_text(box.diagonal(), 3) + " mm, and at rest " +
                     to_text(diagonal_mm_, 3) + " mm" + unit_question(size));
  }
  const double away_mm = (box.center() - center_mm_).norm();
  if (!(away_mm <= kFarthestDiagonals * diagonal_mm_)) {
    throw UsageError("the " + what_ + " lie " + to_text(away_mm, 3) +
                     " mm from their rest, the organ is " + to_text(diagonal_mm_, 3) +
                     " mm large; they are not of this organ, or of another world");
  }
  if (!(stretch > kLeastStretch && stretch < kMostStretch)) {
    throw UsageError("the edges between the " + what_ + " are " + to_text(stretch, 3) +
                     " times as long as at rest; they are in another order, or another organ's");
  }
  if (are_mirrored(now_mm))
    throw UsageError("the " + what_ +
                     " are the organ's mirror image; an axis has the wrong sign (the world is LPS: "
                     "x to the left, y to the back, z up)");
}

template <class Number>
void copy_places(std::span<const Number> xyz_mm, const std::string& what, std::size_t count,
                 std::vector<Eigen::Vector3d>& places) {
  if (xyz_mm.size() != 3 * count) {
    const bool whole = xyz_mm.size() % 3 == 0;
    throw UsageError(std::to_string(whole ? xyz_mm.size() / 3 : xyz_mm.size()) +
                     (whole ? " " : " coordinates of ") + what + " for an organ of " +
                     std::to_string(count));
  }
  places.resize(count);
  double sum = 0;  // of zeros, or not a number
  for (std::size_t i = 0; i < count; ++i) {
    places[i] = Eigen::Vector3d(xyz_mm[3 * i], xyz_mm[3 * i + 1], xyz_mm[3 * i + 2]);
    sum += 0 * (places[i].x() + places[i].y() + places[i].z());
  }
  for (std::size_t i = 0; sum != 0 && i < xyz_mm.size(); ++i) {
    if (!std::isfinite(xyz_mm[i]))
      throw UsageError("of the " + what + ", number " + std::to_string(i / 3) + " is not finite");
  }
}

using Vectors = std::vector<Eigen::Vector3d>;

// Of an edge of a tetrahedron, against 1 of a vertex: skin is met to a thousandth of its motion.
constexpr double kSmooth = 1e-4;
constexpr int kMostRounds = 400;
constexpr double kSmallest = 1e-10;  // of what is left of the residual's square

void hold_anchors(const TetrahedralBody& body, Vectors& rows) {
  for (const std::uint32_t anchor : body.anchors) rows[anchor].setZero();
}

// Wᵀ times rows of the vertices, added up by node.
void spread(const TetrahedralBody& body, const auto& row_of_vertex, Vectors& rows) {
  for (std::size_t v = 0; v < body.vertices.size(); ++v) {
    const Eigen::Vector3d row = row_of_vertex(v);
    each_carrier(body, v, [&](std::uint32_t node, double weight) { rows[node] += weight * row; });
  }
}

Eigen::Vector3d carried(const TetrahedralBody& body, std::size_t vertex, const Vectors& u) {
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  each_carrier(body, vertex, [&](std::uint32_t node, double weight) { moved += weight * u[node]; });
  return moved;
}

// (WᵀW + ε L) u, anchors' rows 0.
void apply(const TetrahedralBody& body, const Vectors& u, Vectors& result) {
  std::fill(result.begin(), result.end(), Eigen::Vector3d::Zero());
  spread(
      body, [&](std::size_t v) { return carried(body, v, u); }, result);
  for (const Tetrahedron& t : body.tetrahedra) {
    const Eigen::Vector3d sum = u[t.nodes[0]] + u[t.nodes[1]] + u[t.nodes[2]] + u[t.nodes[3]];
    for (const std::uint32_t n : t.nodes) result[n] += kSmooth * (4 * u[n] - sum);
  }
  hold_anchors(body, result);
}

double dot(const Vectors& a, const Vectors& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

void add(double scale, const Vectors& from, Vectors& to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += scale * from[i];
}

// Where the vertices lie when the nodes of the tetrahedra that they are embedded in lie elsewhere,
// mm: by how far those are from rest, as the player's solver carries them to rounding. An anchor
// that another solver has moved carries what hangs on it.
void carry_vertices(const TetrahedralBody& body, const std::vector<Eigen::Vector3d>& rest_mm,
                    const std::vector<Eigen::Vector3d>& nodes_mm,
                    std::vector<Eigen::Vector3d>& vertices_mm) {
  vertices_mm.resize(rest_mm.size());
  for (std::size_t v = 0; v < rest_mm.size(); ++v) {
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    each_carrier(body, v, [&](std::uint32_t node, double weight) {
      moved += weight * (nodes_mm[node] - body.nodes_mm[node]);
    });
    vertices_mm[v] = rest_mm[v] + moved;
  }
}

// Nodes that put the vertices where they lie now, nearly, the smoothest there are: displacements u
// that minimise |W u − d|² + ε Σ |u_a − u_b|² over the edges of the tetrahedra, anchors at rest.
// What the inside of an organ does when its skin alone is known: membrane energy (Botsch and
// Sorkine 2008, "On linear variational surface deformation methods", 3.1, in a volume), which has
// no parameter that tissue would have to tell. By conjugate gradients without a matrix (Hestenes
// and Stiefel 1952): it is asked for once, when a step follows a state, and stays small in a page.
std::vector<Eigen::Vector3d> nodes_under(const TetrahedralBody& body,
                                         const std::vector<Eigen::Vector3d>& rest_mm,
                                         const std::vector<Eigen::Vector3d>& vertices_mm) {
  const std::size_t count = body.nodes_mm.size();
  Vectors u(count, Eigen::Vector3d::Zero()), residual = u, product = u;
  spread(
      body, [&](std::size_t v) -> Eigen::Vector3d { return vertices_mm[v] - rest_mm[v]; },
      residual);
  hold_anchors(body, residual);
  Vectors along = residual;
  double left = dot(residual, residual);
  const double enough = kSmallest * left;
  for (int round = 0; round < kMostRounds && left > enough; ++round) {
    apply(body, along, product);
    const double step = left / dot(along, product);
    add(step, along, u);
    add(-step, product, residual);
    const double before = std::exchange(left, dot(residual, residual));
    for (std::size_t n = 0; n < count; ++n) along[n] = residual[n] + left / before * along[n];
  }
  add(1, body.nodes_mm, u);
  return u;
}

}  // namespace

struct StateReader::Impl {
  const Bundle& organ;
  PlausiblePlaces vertices;
  std::optional<PlausiblePlaces> nodes;

  explicit Impl(const Bundle& given)
      : organ(given), vertices("vertices", given.proxy.vertices, given.proxy.faces) {
    if (!organ.mechanics.body) return;
    nodes.emplace("nodes", organ.mechanics.body->nodes_mm, organ.mechanics.body->tetrahedra);
  }
};

StateReader::StateReader(const Bundle& organ) : impl_(std::make_unique<const Impl>(organ)) {}
StateReader::~StateReader() = default;

std::size_t StateReader::count(StateOf of) const {
  const auto& body = impl_->organ.mechanics.body;
  if (of == StateOf::vertices) return impl_->organ.proxy.vertices.size();
  return body ? body->nodes_mm.size() : 0;
}

template <class Number>
void StateReader::read(std::span<const Number> xyz_mm, StateOf of, OrganState& state) const {
  const auto& [organ, vertices, nodes] = *impl_;
  if (of == StateOf::vertices) {
    copy_places(xyz_mm, "vertices", count(of), state.vertices_mm);
    return vertices.check(state.vertices_mm);
  }
  if (!nodes)
    throw UsageError(
        "this organ has no tetrahedra whose nodes could be set; bake it anew "
        "without --set mechanics.fem=false, or set the vertices of its proxy");
  copy_places(xyz_mm, "nodes", count(of), state.nodes_mm);
  nodes->check(state.nodes_mm);
  carry_vertices(*organ.mechanics.body, organ.proxy.vertices, state.nodes_mm, state.vertices_mm);
}

template void StateReader::read(std::span<const float>, StateOf, OrganState&) const;
template void StateReader::read(std::span<const double>, StateOf, OrganState&) const;

struct Player::Placed {
  explicit Placed(const Bundle& now) : reader(now) {}

  StateReader reader;
  OrganState last, next;  // what was set, and room for what comes
  bool since_step = false;
  StateOf of = StateOf::vertices;
};

template <class Number>
void Player::place(std::span<const Number> xyz_mm, StateOf of, std::size_t which) {
  organ_at(which);  // throws where there is none
  Organ& organ = organs_[which];
  if (!organ.placed) organ.placed = std::make_shared<Placed>(organ.now());
  Placed& placed = *organ.placed;
  placed.reader.read(xyz_mm, of, placed.next);
  std::swap(placed.last, placed.next);
  placed.of = of;
  placed.since_step = true;
  organ.positions = placed.last.vertices_mm;
}

void Player::set_vertices(std::span<const float> xyz_mm, std::size_t organ) {
  place(xyz_mm, StateOf::vertices, organ);
}
void Player::set_vertices(std::span<const double> xyz_mm, std::size_t organ) {
  place(xyz_mm, StateOf::vertices, organ);
}
void Player::set_nodes(std::span<const float> xyz_mm, std::size_t organ) {
  place(xyz_mm, StateOf::nodes, organ);
}
void Player::set_nodes(std::span<const double> xyz_mm, std::size_t organ) {
  place(xyz_mm, StateOf::nodes, organ);
}

void Player::save_placed(const Organ& organ, std::optional<OrganState>& state, StateOf& of) {
  if (organ.placed && organ.placed->since_step) state = organ.placed->last, of = organ.placed->of;
}

void Player::restore_placed(Organ& organ, const std::optional<OrganState>& state, StateOf of) {
  if (!state) return;
  organ.placed = std::make_shared<Placed>(organ.now());
  organ.placed->last = *state, organ.placed->of = of;
  organ.placed->since_step = true;
  organ.positions = state->vertices_mm;
}

bool Player::go_on_from_placed() {
  bool any = false;
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    const Organ& organ = organs_[o];
    if (!organ.placed || !std::exchange(organ.placed->since_step, false)) continue;
    any = true;
    const OrganState& state = organ.placed->last;
    if (options_.solver == TissueSolver::springs) {
      deformer_.place(o, state.vertices_mm);
    } else if (organ.placed->of == StateOf::nodes) {
      deformer_.place(o, state.nodes_mm);
    } else {
      const Bundle& now = organ.now();
      deformer_.place(o, nodes_under(*now.mechanics.body, now.proxy.vertices, state.vertices_mm));
    }
  }
  return any;
}

std::vector<Eigen::Vector3d> Player::contact_force_n(const std::vector<Instrument>& instruments,
                                                     std::size_t organ) {
  const std::size_t count = organ_at(organ).positions.size();
  std::size_t first = 0;
  for (std::size_t o = 0; o < organ; ++o) first += organs_[o].positions.size();
  go_on_from_placed();
  std::vector<std::vector<Eigen::Vector3d>> lay;
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    lay.push_back(options_.solver == TissueSolver::fem ? deformer_.node_positions(o)
                                                       : organs_[o].positions);
  }
  const auto lie_still = [&] {
    for (std::size_t o = 0; o < organs_.size(); ++o) deformer_.place(o, lay[o]);
  };
  lie_still();
  deformer_.step(instruments);
  const std::vector<Eigen::Vector3d> all = deformer_.contact_force_n();
  lie_still();
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

}  // namespace organbake
