// SPDX-License-Identifier: GPL-3.0-or-later
#include "vertex_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit_equations.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/nearest_on_triangle.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

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

template <typename Work>
void for_blocks(std::size_t count, Work work) {
  constexpr std::size_t kBlock = 256;
  parallel_for(std::size_t{0}, (count + kBlock - 1) / kBlock, [&](std::size_t b) {
    for (std::size_t i = b * kBlock; i < std::min(count, (b + 1) * kBlock); ++i) work(i);
  });
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
  for_blocks(matches.size(), [&](std::size_t i) {
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
    if (!(now < best_energy)) {
      proxy = halfway(best, proxy);
      continue;
    }
    best = proxy;
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
  if (keep_volume) correct_volume(best, reference.volume_mm3());
  return best;
}

}  // namespace organbake
