// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <utility>

#include "capture/skin_bake.h"
#include "core/random.h"
#include "core/text.h"
#include "decimate/decimate.h"
#include "geometry/shell_map.h"
#include "geometry/shell_surface.h"
#include "organbench/suites/player_parts.h"
#include "phantom/phantom.h"
#include "viewpoints/poked_surface.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kEdge_mm = 6;  // of the skin, as bundles are baked
constexpr int kDents = 16;      // all over the organ
constexpr std::size_t kPoints = 4000;

// Points of a surface, bound to a shell that carries them.
class BoundPoints {
 public:
  BoundPoints(const std::vector<Vector3d>& points, ShellSurface shell)
      : points_(points), shell_(std::move(shell)) {
    const ShellBinder binder(shell_.at_rest(), shell_.reach_mm());
    for (const Vector3d& point : points) bindings_.push_back(binder.bind(point));
  }

  // Squared errors near a poke and the poke's own squared displacements there, summed, mm².
  struct Sums {
    double error2 = 0, poke2 = 0;
  };
  Sums under(const Poke& poke) const {
    const TriangleMesh posed = shell_.posed(poked_surface(shell_.proxy(), poke).vertices);
    const std::vector<ShellMatrix> matrices = shell_matrices(posed);
    TriangleMesh truth;
    truth.vertices = points_;
    truth = poked_surface(std::move(truth), poke);
    constexpr double kNear_sigma = 2.5;
    Sums sums;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if ((points_[i] - poke.site_mm).norm() > kNear_sigma * poke.sigma_mm) continue;
      const ShellBinding& b = bindings_[i];
      const Vector3d is = shell_point(matrices[b.face], b.b1, b.b2, b.height_mm);
      sums.error2 += (is - truth.vertices[i]).squaredNorm();
      sums.poke2 += (truth.vertices[i] - points_[i]).squaredNorm();
    }
    return sums;
  }

 private:
  const std::vector<Vector3d>& points_;
  ShellSurface shell_;
  std::vector<ShellBinding> bindings_;
};

// Dents as deep as they are wide, straight in.
std::vector<Poke> dents(const TriangleMesh& surface, double sigma_mm) {
  RandomStream random(7);
  const std::vector<Vector3d> normals = vertex_normals(surface);
  std::vector<Poke> pokes;
  for (int i = 0; i < kDents; ++i) {
    const std::uint64_t v = random.below(surface.vertices.size());
    pokes.push_back({surface.vertices[v], -sigma_mm * normals[v], sigma_mm});
  }
  return pokes;
}

// RMS of the error near the dents in % of their own.
double error_percent(const BoundPoints& bound, const std::vector<Poke>& pokes) {
  BoundPoints::Sums all;
  for (const Poke& poke : pokes) {
    const auto [error2, poke2] = bound.under(poke);
    all.error2 += error2, all.poke2 += poke2;
  }
  return 100 * std::sqrt(all.error2 / all.poke2);
}

}  // namespace

void promise_dents(Bench& bench) {
  const TriangleMesh surface = OrganPhantom({}).surface(6);
  std::vector<Vector3d> points;
  for (std::size_t v = 0; v < surface.vertices.size(); v += surface.vertices.size() / kPoints)
    points.push_back(surface.vertices[v]);
  for (const std::size_t faces : {80u, 300u, 1000u}) {
    bench.now("dents in " + std::to_string(faces) + " faces");
    DecimateOptions options;
    options.faces = faces;
    const TriangleMesh proxy = decimate(surface, options).proxy;
    SmoothSkin skin;
    const Timing bake =
        bench.time([&] { skin = bake_smooth_skin(surface, proxy, kEdge_mm, bench.context()); });
    const BoundPoints prism(points, ShellSurface(proxy)), smooth(points, ShellSurface(proxy, skin));
    const std::string name = std::to_string(faces) + " faces";
    bench.add(Figure{"the smooth skin of " + name + ": baked in", "ms", bake.wall_ms.median, 300});
    // The prototype's, as shares of what its prisms missed by.
    const double target_of_24 = faces == 80 ? 0.61 : faces == 300 ? 0.31 : 0.30;
    const double target_of_12 = faces == 80 ? 1.0 : faces == 300 ? 0.59 : 0.24;
    for (const auto& [sigma_mm, target] : {std::pair(24.0, target_of_24), {12.0, target_of_12}}) {
      const std::vector<Poke> pokes = dents(surface, sigma_mm);
      const double in_prisms = error_percent(prism, pokes), in_skin = error_percent(smooth, pokes);
      const std::string scene =
          name + ", dents of " + to_text(sigma_mm) + " mm: the surface's RMS error";
      bench.add(Figure{scene + " in prisms", "% of the dent's", in_prisms, 100});
      bench.add(Figure{scene + " in the skin", "% of the dent's", in_skin, target * in_prisms});
    }
  }
}

}  // namespace organbake
