// SPDX-License-Identifier: GPL-3.0-or-later
// What is promised of pieces that blades have cut free: they stop at the organ and come to rest.
#include "organbake/core/random.h"
#include "organbake/core/union_find.h"
#include "organbake/cutting/blade_sweeps.h"
#include "organbake/deform/deformer.h"
#include "organbake/mechanics/mechanics.h"
#include "promises.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// A lumpy organ of 55 mm that hangs on its one end, its other end cut off by a seeded plane; and a
// tool that pokes the piece from one of eight sides and is then taken away.
class FreePiece {
 public:
  explicit FreePiece(std::uint64_t seed)
      : random_(seed), side_(seed % 8), cut_(organ_of(seed)), pieces_(part()) {
    for (std::uint32_t v = 0; v < parted().proxy.vertices.size(); ++v)
      if (is_free(v)) own_.push_back(v);
    for (const Face& f : parted().proxy.faces)
      if (!is_free(f[0])) others_.push_back(f);
  }

  bool is_there() const { return !own_.empty() && !others_.empty(); }

  struct Course {
    double deepest_winding = 0;  // of the rest of the organ about the piece's middle: 1 inside
    double energy_j = 0, energy_left_j = 0;
  };
  Course poke() {
    constexpr int kUntouched = 180;  // steps: 3 s
    constexpr double kRadius_mm = 3, kAhead_mm = 8;
    DeformOptions options;
    options.solver = TissueSolver::fem;
    deformer_.emplace(
        DeformBodies{{parted().proxy, parted().mechanics, parted().base, &*parted().skin}},
        options);
    const Vector3d middle = this->middle();
    const double out = middle.x() < 0 ? -1 : 1, angle = double(side_) * std::numbers::pi / 4;
    const Vector3d from =
        Vector3d(out * random_.uniform(0.1, 1.5), std::cos(angle), std::sin(angle)).normalized();
    double reach_mm = 0;
    for (const std::uint32_t v : own_)
      reach_mm = std::max(reach_mm, (deformer_->positions()[v] - middle).dot(from));
    const double past_mm = random_.uniform(2, 12);
    const int steps = static_cast<int>(random_.uniform(24, 60));
    Course course;
    std::vector<Vector3d> before = deformer_->node_positions(0);
    for (int step = 0; step <= steps + kUntouched; ++step) {
      Instrument tip;
      tip.radius_mm = kRadius_mm;
      tip.active = step <= steps;
      const double share = double(step) / steps;
      tip.position_mm = middle + ((1 - share) * (reach_mm + kAhead_mm) - share * past_mm) * from;
      deformer_->step({tip});
      const std::vector<Vector3d> now = deformer_->node_positions(0);
      course.energy_left_j = energy_j(before, now);
      if (step >= steps) course.energy_j = std::max(course.energy_j, course.energy_left_j);
      before = now;
      course.deepest_winding = std::max(course.deepest_winding, winding(this->middle()));
    }
    return course;
  }

 private:
  const Bundle& parted() const { return cut_.now(); }
  const TetrahedralBody& body() const { return *parted().mechanics.body; }

  CutOrgan organ_of(std::uint64_t seed) {
    Bundle organ;
    organ.manifest.name = "lumpy";
    organ.proxy = lumpy_mesh(20, 2);
    for (Vector3d& v : organ.proxy.vertices) v = v.cwiseProduct(Vector3d(1.4, 0.7, 1));
    out_ = seed % 2 ? -1 : 1;
    MechanicsOptions options;
    options.fem = true;
    options.anchor_fraction = 0.3;
    options.anchor_direction = Vector3d(-out_, 0.3, 0);
    organ.mechanics = make_mechanics(organ.proxy, options);
    return CutOrgan(organ);
  }
  // What hangs together, by node.
  std::vector<std::uint32_t> part() {
    constexpr int kSteps = 60;
    constexpr double kHalf_mm = 75;
    const double x = out_ * random_.uniform(8, 18);
    const double tilt = random_.uniform(-0.4, 0.4), turn = random_.uniform(-0.4, 0.4);
    BladeSweeps sweeps(cut_);
    for (int i = 0; i <= kSteps; ++i) {
      const double y = kHalf_mm - 2 * kHalf_mm * i / kSteps;
      const Vector3d tip(x + tilt * y - turn * kHalf_mm, y, -kHalf_mm);
      const CuttingStep now{0, {tip, tip + 2 * kHalf_mm * Vector3d(turn, 0, 1)}};
      sweeps.advance({&now, 1}, cut_, cut_.body().uncut().nodes_mm);
    }
    cut_.part(sweeps.sheet());
    UnionFind joined(body().nodes_mm.size());
    for (const Tetrahedron& t : body().tetrahedra)
      for (const std::uint32_t n : t.nodes) joined.join(t.nodes[0], n);
    return std::move(joined).roots();
  }
  bool is_free_node(std::uint32_t node) const {
    return std::none_of(body().anchors.begin(), body().anchors.end(),
                        [&](std::uint32_t a) { return pieces_[a] == pieces_[node]; });
  }
  bool is_free(std::uint32_t vertex) const {
    return is_free_node(body().tetrahedra[body().vertices[vertex].tetrahedron].nodes[0]);
  }
  Vector3d middle() const {
    Vector3d sum = Vector3d::Zero();
    for (const std::uint32_t v : own_) sum += deformer_->positions()[v];
    return sum / double(own_.size());
  }
  double energy_j(const std::vector<Vector3d>& before, const std::vector<Vector3d>& now) const {
    constexpr double kMetresPerSecond = 60e-3;  // per mm and step
    const std::vector<double> mass_kg =
        node_masses_kg(body(), parted().mechanics.density_kg_per_m3);
    double sum = 0;
    for (std::uint32_t n = 0; n < now.size(); ++n)
      if (pieces_[n] == pieces_[piece_node()])
        sum += mass_kg[n] / 2 * (kMetresPerSecond * (now[n] - before[n])).squaredNorm();
    return sum;
  }
  std::uint32_t piece_node() const {
    return body().tetrahedra[body().vertices[own_.front()].tetrahedron].nodes[0];
  }
  // By the solid angles of its faces (van Oosterom and Strackee 1983).
  double winding(const Vector3d& point) const {
    double sum = 0;
    for (const auto& [i, j, k] : others_) {
      const Vector3d a = deformer_->positions()[i] - point, b = deformer_->positions()[j] - point,
                     c = deformer_->positions()[k] - point;
      const double la = a.norm(), lb = b.norm(), lc = c.norm();
      sum += std::atan2(a.dot(b.cross(c)),
                        la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (2 * std::numbers::pi);
  }

  RandomStream random_;
  std::uint64_t side_;
  double out_ = 1;
  CutOrgan cut_;
  std::vector<std::uint32_t> pieces_;
  std::vector<std::uint32_t> own_;  // vertices
  std::vector<Face> others_;
  std::optional<Deformer> deformer_;
};

TEST(FreePieces, StopAtTheOrganAndComeToRest) {
  constexpr double kInside = 0.5;  // of a winding number
  constexpr double kMostEnergyLeft = 0.01;
  const Seeds seeds = asked_seeds(2, 300);
  double beyond = 0, coasting = 0, pieces = 0;
  for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
    FreePiece piece(seed);
    if (!piece.is_there()) continue;
    const FreePiece::Course course = piece.poke();
    ++pieces;
    beyond += course.deepest_winding > kInside;
    coasting += course.energy_left_j > kMostEnergyLeft * course.energy_j;
  }
  expect({"free pieces, poked: those whose middle went beyond the organ's skin", "", beyond, 0});
  expect({"free pieces, 3 s untouched: those with more than 1 % of their energy", "", coasting, 0});
  report("free pieces that were cut off", "", pieces);
}

}  // namespace
}  // namespace organbake
