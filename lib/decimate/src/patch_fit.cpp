// SPDX-License-Identifier: GPL-3.0-or-later
// The fit of a few vertices with the faces round them, to tell what a local change is worth.
// Closest points are asked for at the start and the end only; in between the surface's tangent
// planes stand in for it, for asking is what costs time.
#include "proxies.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMostUnknowns = 3 * static_cast<int>(kMostFree);
using Matrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostUnknowns, kMostUnknowns>;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostUnknowns, 1>;

class PatchSolver {
 public:
  PatchSolver(ProxyPatch& patch, const FitReference& reference, const PatchFitOptions& options)
      : patch_(patch), reference_(reference), options_(options) {}

  PatchFit run() {
    PatchFit fit = measure(Targets::given);
    for (int step = 0; step < options_.steps; ++step) {
      // A step rarely takes off more than this factor.
      const double hope = step == 0 ? 6.0 : step == 1 ? 1.5 : 1.1;
      if ((options_.give_up > 0 && fit.energy > hope * options_.give_up) || !move()) return bad();
      fit = measure(step + 1 < options_.steps ? Targets::tangent : Targets::exact);
    }
    if (!sound(fit)) return bad();
    fit.targets = std::move(targets_);
    return fit;
  }

  PatchFit measured() {
    PatchFit fit = measure(Targets::exact);
    fit.targets = std::move(targets_);
    return fit;
  }

 private:
  enum class Targets { given, tangent, exact };

  static PatchFit bad() {
    PatchFit fit;
    fit.energy = kInfinity;
    return fit;
  }

  const Eigen::Vector3d& corner(std::size_t face, int c) const {
    return patch_.vertices[patch_.faces[face][c]];
  }

  // Energies of the present place, and the equations of the next step.
  PatchFit measure(Targets targets) {
    const auto unknowns = static_cast<Eigen::Index>(3 * patch_.free);
    matrix_ = Matrix::Zero(unknowns, unknowns);
    right_ = Vector::Zero(unknowns);
    normals_.resize(patch_.faces.size());
    targets_.resize(patch_.faces.size());
    PatchFit fit;
    fit.face_energy.assign(patch_.faces.size(), 0);
    fit.facing.assign(patch_.faces.size(), 0);
    for (std::size_t f = 0; f < patch_.faces.size(); ++f) measure_face(f, targets, fit);
    fit.owner.reserve(patch_.samples.size());
    for (const std::uint32_t sample : patch_.samples) measure_sample(sample, fit);
    for (const double e : fit.face_energy) fit.energy += e;
    return fit;
  }

  void measure_face(std::size_t f, Targets mode, PatchFit& fit) {
    const Eigen::Vector3d &a = corner(f, 0), &b = corner(f, 1), &c = corner(f, 2);
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double length = normal.norm();
    normals_[f] = length > 0 ? Eigen::Vector3d(normal / length) : Eigen::Vector3d::Zero();
    FaceTargets& targets = targets_[f];
    if (mode == Targets::given && f < patch_.targets.size()) {
      targets = *patch_.targets[f];
    } else if (mode != Targets::tangent) {
      targets.assign(reference_.points_on_face(0.5 * length), {});
    }
    const bool ask =
        mode == Targets::exact || (mode == Targets::given && f >= patch_.targets.size());
    const std::size_t points = targets.size();
    const double share = 0.5 * length / (reference_.area_mm2() * double(points));
    for (std::size_t i = 0; i < points; ++i) {
      const Eigen::Vector3d w = FitReference::weights_on_face(i);
      const Eigen::Vector3d point = w[0] * a + w[1] * b + w[2] * c;
      if (ask) {
        const ClosestPoint closest = reference_.closest(point);
        targets[i] = {closest.point, reference_.normal(closest.face)};
      }
      const auto& [target, across] = targets[i];
      fit.facing[f] += normals_[f].dot(across) / double(points);
      const Eigen::Vector3d gap = target - point;
      add(f, w, mode == Targets::tangent ? Eigen::Vector3d(gap.dot(across) * across) : gap, share,
          fit);
    }
  }

  void measure_sample(std::uint32_t sample, PatchFit& fit) {
    const Eigen::Vector3d& at = reference_.samples()[sample];
    double nearest2 = kInfinity;
    std::uint32_t owner = 0;
    Eigen::Vector3d weights, gap;
    for (std::uint32_t f = 0; f < patch_.faces.size(); ++f) {
      const Eigen::Vector3d &a = corner(f, 0), &b = corner(f, 1), &c = corner(f, 2);
      const double height = normals_[f].dot(at - a);
      if (height * height >= nearest2) continue;
      const Eigen::Vector3d w = nearest_on_triangle(at, a, b, c);
      const Eigen::Vector3d to = at - (w[0] * a + w[1] * b + w[2] * c);
      if (to.squaredNorm() >= nearest2) continue;
      nearest2 = to.squaredNorm();
      owner = f;
      weights = w;
      gap = to;
    }
    fit.owner.push_back(owner);
    add(owner, weights, gap, reference_.sample_weight(), fit);
  }

  void add(std::size_t f, const Eigen::Vector3d& w, const Eigen::Vector3d& gap, double share,
           PatchFit& fit) {
    fit.face_energy[f] += share * options_.norm.energy(gap.squaredNorm());
    const Face& face = patch_.faces[f];
    if (face[0] >= patch_.free && face[1] >= patch_.free && face[2] >= patch_.free) return;
    const FitTerm term(gap, normals_[f], share, options_.norm);
    for (int i = 0; i < 3; ++i) {
      if (face[i] >= patch_.free) continue;
      right_.segment<3>(3 * face[i]) += w[i] * term.right;
      for (int j = 0; j < 3; ++j) {
        if (face[j] >= patch_.free) continue;
        matrix_.block<3, 3>(3 * face[i], 3 * face[j]) += (w[i] * w[j]) * term.matrix;
      }
    }
  }

  Vector volume_gradient() const {
    Vector gradient = Vector::Zero(right_.size());
    for (const Face& f : patch_.faces) {
      for (int c = 0; c < 3; ++c) {
        if (f[c] >= patch_.free) continue;
        const Eigen::Vector3d &p = patch_.vertices[f[(c + 1) % 3]],
                              &q = patch_.vertices[f[(c + 2) % 3]];
        gradient.segment<3>(3 * f[c]) += p.cross(q) / 6;
      }
    }
    return gradient;
  }

  bool move() {
    constexpr double kDamping = 1e-3;
    const double trace = matrix_.trace();
    if (!(trace > 0)) return false;
    matrix_.diagonal().array() += kDamping * trace / double(matrix_.rows());
    const Eigen::LDLT<Matrix> cholesky(matrix_);
    Vector step = cholesky.solve(right_);
    if (options_.keep_volume) {
      const Vector gradient = volume_gradient(), direction = cholesky.solve(gradient);
      const double curvature = gradient.dot(direction);
      const double change = options_.volume_mm3 - patch_volume(patch_, Eigen::Vector3d::Zero());
      if (curvature > 0) step += (change - gradient.dot(step)) / curvature * direction;
    }
    if (!step.allFinite()) return false;
    for (std::size_t v = 0; v < patch_.free; ++v) {
      patch_.vertices[v] += step.segment<3>(static_cast<Eigen::Index>(3 * v));
    }
    return true;
  }

  bool sound(const PatchFit& fit) const {
    for (std::size_t f = 0; f < patch_.faces.size(); ++f) {
      if (fit.facing[f] < options_.least_facing ||
          face_quality(corner(f, 0), corner(f, 1), corner(f, 2)) < options_.least_quality) {
        return false;
      }
    }
    return true;
  }

  ProxyPatch& patch_;
  const FitReference& reference_;
  const PatchFitOptions& options_;
  Matrix matrix_;
  Vector right_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<FaceTargets> targets_;
};

}  // namespace

PatchFit fit_patch(ProxyPatch& patch, const FitReference& reference,
                   const PatchFitOptions& options) {
  return PatchSolver(patch, reference, options).run();
}

PatchFit measure_patch(ProxyPatch& patch, const FitReference& reference, const FitNorm& norm) {
  const PatchFitOptions options{.norm = norm};
  return PatchSolver(patch, reference, options).measured();
}

double patch_volume(const ProxyPatch& patch, const Eigen::Vector3d& from) {
  double volume = 0;
  for (const Face& f : patch.faces) {
    volume += (patch.vertices[f[0]] - from)
                  .dot((patch.vertices[f[1]] - from).cross(patch.vertices[f[2]] - from)) /
              6;
  }
  return volume;
}

double face_quality(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double edges2 = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return edges2 > 0 ? 2 * std::sqrt(3.0) * (b - a).cross(c - a).norm() / edges2 : 0;
}

}  // namespace organbake
