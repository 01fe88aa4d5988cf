// SPDX-License-Identifier: GPL-3.0-or-later
// All vertices of a proxy moved at once to lower its two-sided distance to a surface
// (Gauss–Newton). The surface is evenly spread samples and a search tree; points on the proxy's
// faces follow a low-discrepancy sequence, so that few of them cover a face. The normal equations
// are a sparse matrix of 3 × 3 blocks, factored by Cholesky; a kept volume is one linear constraint
// on the step, met by one more solve.
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/refine.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"
#include "proxies.h"

namespace organbake {
namespace {

constexpr std::uint64_t kSeed = 0x6669'7473'616d'706c;

bool is_closed(const TriangleMesh& mesh) {
  const auto twins = manifold_twins(mesh);
  return twins && std::find(twins->begin(), twins->end(), kNoHalfEdge) == twins->end();
}

}  // namespace

FitReference::FitReference(const TriangleMesh& surface, const TriangleMesh& thinned,
                           std::size_t samples)
    : volume_mm3_(signed_volume(surface)),
      closed_(is_closed(thinned)),
      scene_(std::make_shared<RayScene>(thinned)) {
  const AreaSampler sample(surface, samples, kSeed);
  area_mm2_ = sample.area_mm2();
  samples_.reserve(samples);
  for (std::size_t i = 0; i < samples; ++i) samples_.push_back(sample(i));
  std::vector<Eigen::Vector3d> normals(thinned.faces.size());
  for (std::size_t f = 0; f < normals.size(); ++f) normals[f] = face_normal(thinned, f);
  normals_ = std::make_shared<std::vector<Eigen::Vector3d>>(std::move(normals));
}

FitReference FitReference::every(std::size_t k) const {
  FitReference result = *this;
  result.samples_.clear();
  for (std::size_t i = 0; i < samples_.size(); i += k) result.samples_.push_back(samples_[i]);
  return result;
}

std::size_t FitReference::points_on_face(double face_area_mm2) const {
  constexpr double kFewest = 4, kMost = 4096;
  const double even = face_area_mm2 / area_mm2_ * double(samples_.size());
  return static_cast<std::size_t>(std::clamp(std::round(even), kFewest, kMost));
}

// The R2 sequence (Roberts 2018) on the unit square, folded onto the triangle.
Eigen::Vector3d FitReference::weights_on_face(std::size_t i) {
  constexpr double kPlastic = 1.32471795724474602596;
  double u = std::fmod(0.5 + double(i + 1) / kPlastic, 1.0);
  double v = std::fmod(0.5 + double(i + 1) / (kPlastic * kPlastic), 1.0);
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  return {1 - u - v, u, v};
}

namespace {

// The normal equations of one Gauss–Newton step for all of a proxy's vertices: sparse, 3 × 3
// blocks. Faces stay the same from step to step, so the pattern is analysed once.
class FitEquations {
 public:
  FitEquations(const std::vector<Face>& faces, std::size_t vertices)
      : faces_(faces), vertices_(vertices), sums_(faces.size()) {}

  void clear();
  // A sample whose proxy point has these barycentric weights in `face`.
  void add(std::uint32_t face, const Eigen::Vector3d& weights, const FitTerm& term);

  // The step of every vertex. With a volume gradient (one per vertex) the step changes the linear
  // volume by exactly volume_change; without (empty) it is free. Empty when there is no solution.
  std::vector<Eigen::Vector3d> solve(const std::vector<Eigen::Vector3d>& volume_gradient,
                                     double volume_change);

 private:
  struct FaceSums {
    std::array<Eigen::Matrix3d, 6> blocks;  // 00 01 02 11 12 22
    std::array<Eigen::Vector3d, 3> right;
  };

  const std::vector<Face>& faces_;
  std::size_t vertices_;
  std::vector<FaceSums> sums_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> cholesky_;
  bool analysed_ = false;
};

void FitEquations::clear() {
  for (FaceSums& sums : sums_) {
    sums.blocks.fill(Eigen::Matrix3d::Zero());
    sums.right.fill(Eigen::Vector3d::Zero());
  }
}

void FitEquations::add(std::uint32_t face, const Eigen::Vector3d& weights, const FitTerm& term) {
  FaceSums& sums = sums_[face];
  int block = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) sums.blocks[block++] += (weights[i] * weights[j]) * term.matrix;
    sums.right[i] += weights[i] * term.right;
  }
}

std::vector<Eigen::Vector3d> FitEquations::solve(
    const std::vector<Eigen::Vector3d>& volume_gradient, double volume_change) {
  // Vertices that no sample speaks for must not make the matrix singular.
  constexpr double kDamping = 1e-4;  // of the mean diagonal
  const auto n = static_cast<Eigen::Index>(3 * vertices_);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(81 * faces_.size() / 2 + n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  double trace = 0;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    int block = 0;
    for (int i = 0; i < 3; ++i) {
      right.segment<3>(3 * faces_[f][i]) += sums_[f].right[i];
      for (int j = i; j < 3; ++j, ++block) {
        // The lower triangle only: that is what the factorisation reads.
        const std::uint32_t row = std::max(faces_[f][i], faces_[f][j]);
        const std::uint32_t column = std::min(faces_[f][i], faces_[f][j]);
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < (i == j ? r + 1 : 3); ++c) {
            entries.emplace_back(3 * row + r, 3 * column + c, sums_[f].blocks[block](r, c));
          }
        }
        if (i == j) trace += sums_[f].blocks[block].trace();
      }
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) entries.emplace_back(i, i, kDamping * trace / double(n));
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  if (!analysed_) cholesky_.analyzePattern(matrix);
  analysed_ = true;
  cholesky_.factorize(matrix);
  if (!(trace > 0) || cholesky_.info() != Eigen::Success) return {};

  Eigen::VectorXd step = cholesky_.solve(right);
  if (!volume_gradient.empty()) {
    const Eigen::Map<const Eigen::VectorXd> gradient(volume_gradient.front().data(), n);
    const Eigen::VectorXd direction = cholesky_.solve(gradient);
    const double curvature = gradient.dot(direction);
    if (curvature > 0) step += (volume_change - gradient.dot(step)) / curvature * direction;
  }
  if (!step.allFinite()) return {};
  std::vector<Eigen::Vector3d> result(vertices_);
  for (std::size_t v = 0; v < vertices_; ++v) {
    result[v] = step.segment<3>(static_cast<Eigen::Index>(3 * v));
  }
  return result;
}

// One sample at the current proxy: where on the proxy, and how far to its target.
struct Match {
  std::uint32_t face = kNoHit;
  Eigen::Vector3d weights;
  Eigen::Vector3d gap;  // target − proxy point
  double share = 0;     // of the energy
};

Eigen::Vector3d blend(const TriangleMesh& mesh, std::uint32_t face, const Eigen::Vector3d& w) {
  const Face& f = mesh.faces[face];
  return w[0] * mesh.vertices[f[0]] + w[1] * mesh.vertices[f[1]] + w[2] * mesh.vertices[f[2]];
}

Match match_sample(const TriangleMesh& proxy, const RayScene& scene, const Eigen::Vector3d& sample,
                   double share) {
  Match match;
  match.share = share;
  match.face = scene.closest_point(sample).face;
  const Face& f = proxy.faces[match.face];
  match.weights =
      nearest_on_triangle(sample, proxy.vertices[f[0]], proxy.vertices[f[1]], proxy.vertices[f[2]]);
  match.gap = sample - blend(proxy, match.face, match.weights);
  return match;
}

// Both sides: samples of the surface to the proxy, points of the proxy to the surface.
std::vector<Match> match_both(const TriangleMesh& proxy, const FitReference& reference) {
  std::vector<Match> matches(reference.samples().size());
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    const double area = face_area(proxy, f);
    const std::size_t points = reference.points_on_face(area);
    const double share = area / (reference.area_mm2() * double(points));
    for (std::size_t i = 0; i < points; ++i) {
      matches.push_back({f, FitReference::weights_on_face(i), {}, share});
    }
  }
  const RayScene scene(proxy);
  constexpr std::size_t kAtOnce = 256;
  parallel_each(std::size_t{0}, matches.size(), kAtOnce, [&](std::size_t i) {
    if (i < reference.samples().size()) {
      matches[i] = match_sample(proxy, scene, reference.samples()[i], reference.sample_weight());
    } else {
      const Eigen::Vector3d point = blend(proxy, matches[i].face, matches[i].weights);
      matches[i].gap = reference.closest(point).point - point;
    }
  });
  return matches;
}

double energy(const std::vector<Match>& matches, const FitNorm& norm) {
  double sum = 0;
  for (const Match& m : matches) sum += m.share * norm.energy(m.gap.squaredNorm());
  return sum;
}

double largest(const std::vector<Match>& matches) {
  double distance = 1e-30;  // it divides
  for (const Match& m : matches) distance = std::max(distance, m.gap.norm());
  return distance;
}

std::vector<Eigen::Vector3d> face_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals(mesh.faces.size());
  for (std::size_t f = 0; f < normals.size(); ++f) normals[f] = face_normal(mesh, f);
  return normals;
}

// Whether a face may go so far: it neither turns far nor loses most of its area, nor leans farther
// from the skin about its corners than a face on a ridge does. (Small turns add up over the steps:
// slivers would fold over onto their neighbours.)
class AllowedFaces {
 public:
  AllowedFaces(const TriangleMesh& from, const std::vector<Eigen::Vector3d>& normals)
      : from_(&from), normals_(&normals), skin_(vertex_normals(from)) {}

  bool operator()(const TriangleMesh& to, std::size_t f) const {
    constexpr double kLeastCosine = 0.5, kLeastArea = 0.1, kLeastAlongSkin = 0.2;
    const Eigen::Vector3d normal = face_normal(to, f);
    if ((*normals_)[f].dot(normal) < kLeastCosine) return false;
    const auto leans = [&](std::uint32_t v) {
      const double along = normal.dot(skin_[v]);
      return along < kLeastAlongSkin && along < (*normals_)[f].dot(skin_[v]);
    };
    const Face& face = from_->faces[f];
    if (std::any_of(face.begin(), face.end(), leans)) return false;
    return face_area(to, f) >= kLeastArea * face_area(*from_, f);
  }

 private:
  const TriangleMesh* from_;
  const std::vector<Eigen::Vector3d>* normals_;  // of the faces
  std::vector<Eigen::Vector3d> skin_;            // by vertex
};

// Shortens the steps round faces that would go too far.
TriangleMesh stepped(const TriangleMesh& from, const std::vector<Eigen::Vector3d>& normals,
                     std::vector<Eigen::Vector3d> step) {
  constexpr int kHalvings = 6;
  const AllowedFaces allowed(from, normals);
  TriangleMesh to = from;
  for (int attempt = 0; attempt <= kHalvings; ++attempt) {
    for (std::size_t v = 0; v < step.size(); ++v) to.vertices[v] = from.vertices[v] + step[v];
    std::vector<bool> shorten(step.size(), false);
    bool any = false;
    for (std::size_t f = 0; f < from.faces.size(); ++f) {
      if (allowed(to, f)) continue;
      any = true;
      for (const std::uint32_t v : from.faces[f]) shorten[v] = true;
    }
    if (!any) return to;
    for (std::size_t v = 0; v < step.size(); ++v) {
      if (shorten[v]) step[v] *= attempt + 1 < kHalvings ? 0.5 : 0.0;
    }
  }
  return from;
}

TriangleMesh halfway(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh result = a;
  for (std::size_t v = 0; v < a.vertices.size(); ++v) {
    result.vertices[v] = 0.5 * (a.vertices[v] + b.vertices[v]);
  }
  return result;
}

// What is left of the volume's change after linear steps, spread over all vertices.
void correct_volume(TriangleMesh& proxy, double volume_mm3) {
  for (int i = 0; i < 2; ++i) {
    const std::vector<Eigen::Vector3d> gradient = volume_gradient(proxy);
    double length2 = 0;
    for (const Eigen::Vector3d& g : gradient) length2 += g.squaredNorm();
    if (!(length2 > 0)) return;
    const double factor = (volume_mm3 - signed_volume(proxy)) / length2;
    for (std::size_t v = 0; v < gradient.size(); ++v) proxy.vertices[v] += factor * gradient[v];
  }
}

}  // namespace

std::vector<Eigen::Vector3d> volume_gradient(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> gradient(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const Face& f : mesh.faces) {
    for (int c = 0; c < 3; ++c) {
      gradient[f[c]] += mesh.vertices[f[(c + 1) % 3]].cross(mesh.vertices[f[(c + 2) % 3]]) / 6;
    }
  }
  return gradient;
}

double largest_distance(const TriangleMesh& proxy, const FitReference& reference) {
  return largest(match_both(proxy, reference));
}

TriangleMesh fit_vertices(TriangleMesh proxy, const FitReference& reference,
                          const FitOptions& options, const RunContext& context) {
  const bool keep_volume = options.keep_volume && reference.closed();
  FitEquations equations(proxy.faces, proxy.vertices.size());
  TriangleMesh best = proxy;
  double best_energy = std::numeric_limits<double>::infinity();
  FitNorm norm{.power = options.power};
  for (int i = 0; i < options.steps; ++i) {
    context.throw_if_cancelled();
    const std::vector<Match> matches = match_both(proxy, reference);
    if (i == 0) norm.scale = largest(matches);
    const double now = energy(matches, norm);
    // A step that did not help was too long: half of it is tried next.
    if (!(now < best_energy)) {
      proxy = halfway(best, proxy);
      continue;
    }
    best = proxy;
    // Further steps would gain nothing that measuring could tell.
    const bool settled = now > (1 - 1e-4) * best_energy;
    best_energy = now;
    if (settled || i + 1 == options.steps) break;

    equations.clear();
    const std::vector<Eigen::Vector3d> normals = face_normals(proxy);
    for (const Match& m : matches) {
      equations.add(m.face, m.weights, {m.gap, normals[m.face], m.share, norm});
    }
    std::vector<Eigen::Vector3d> step =
        keep_volume
            ? equations.solve(volume_gradient(proxy), reference.volume_mm3() - signed_volume(proxy))
            : equations.solve({}, 0);
    if (step.empty()) break;
    proxy = stepped(proxy, normals, std::move(step));
  }
  // Each step keeps the volume to first order only.
  if (keep_volume) correct_volume(best, reference.volume_mm3());
  return best;
}

}  // namespace organbake
