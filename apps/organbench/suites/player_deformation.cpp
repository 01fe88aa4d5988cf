// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "bench.h"
#include "measuring/frame_timing.h"
#include "organbake/capture/capture.h"
#include "organbake/decimate/decimate.h"
#include "organbake/deform/deformer.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/phantom/phantom.h"

namespace organbake {
namespace {

// A probe that presses the organ's front now more, now less, and is dragged sideways.
class Poking {
 public:
  explicit Poking(const TriangleMesh& proxy)
      : front_(Eigen::Vector3d(0.2, -1, 0.3).normalized()),
        aside_(front_.cross(Eigen::Vector3d::UnitZ()).normalized()) {
    const Eigen::Vector3d center = bounds(proxy).center();
    double highest = -1;
    for (const Eigen::Vector3d& v : proxy.vertices) {
      const double cosine = (v - center).normalized().dot(front_);
      if (cosine > highest) highest = cosine, skin_ = v;
    }
  }

  Instrument at(double seconds) const {
    constexpr double kDeep_mm = 15, kAside_mm = 8;
    const double depth = kDeep_mm * (0.5 - 0.5 * std::cos(2 * std::numbers::pi * seconds)) + 2;
    Instrument tip;
    tip.active = true;
    tip.position_mm =
        skin_ + (tip.radius_mm - depth) * front_ + kAside_mm * std::sin(1.3 * seconds) * aside_;
    return tip;
  }

 private:
  Eigen::Vector3d front_, aside_, skin_ = Eigen::Vector3d::Zero();
};

void promise_step(Bench& bench, const TriangleMesh& organ, std::size_t faces, double target_ms,
                  TissueSolver solver = TissueSolver::springs) {
  bench.now("deformation of a proxy of " + std::to_string(faces) + " faces");
  const TriangleMesh proxy = decimate(organ, {.faces = faces}, bench.context()).proxy;
  const Poking poking(proxy);
  const int steps = bench.quick() ? 60 : 300;
  MechanicsOptions mechanics;
  mechanics.fem = solver == TissueSolver::fem;
  DeformOptions deform;
  deform.solver = solver;
  Deformer deformer(proxy, make_mechanics(proxy, mechanics), {}, deform);
  int step = 0;
  std::size_t contacts = 0;
  const Timing timing = bench.time([&] {
    for (int i = 0; i < steps; ++i, ++step)
      contacts += deformer.step({poking.at(step / 60.0)}).contacts;
  });
  const std::string what =
      "deformation step, " + std::to_string(proxy.vertices.size()) + " vertices, " +
      (solver == TissueSolver::fem ? "finite elements, " : "") + "a probe pressed in and dragged";
  bench.at_most(what + ": CPU time, mean", "ms", timing.cpu_ms.median / steps, target_ms);
  // That it is touched at all; a solid rests on fewer points than springs, which crease.
  const double least_contacts = solver == TissueSolver::fem ? 0.5 : 1;
  bench.at_least(what + ": contacts, mean", "", double(contacts) / step, least_contacts);
}

using Path = std::vector<std::vector<Eigen::Vector3d>>;

// From rest on: the probe presses and drags for three seconds, and then stays for one.
Path poked_path(Deformer& deformer, const Poking& poking) {
  constexpr int kMoving = 180, kResting = 60;
  deformer.reset();
  Path path;
  for (int step = 0; step < kMoving + kResting; ++step) {
    deformer.step({poking.at(std::min(step, kMoving) / 60.0)});
    path.push_back(deformer.positions());
  }
  return path;
}

double mean_square(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double sum = 0;
  for (std::size_t v = 0; v < a.size(); ++v) sum += (a[v] - b[v]).squaredNorm();
  return sum / double(a.size());
}

// Run time against error: the iterations of a step.
void sweep_iterations(Bench& bench, const TriangleMesh& organ) {
  constexpr int kConverged = 64;
  bench.now("iterations of a step");
  const TriangleMesh proxy = decimate(organ, {.faces = 996}, bench.context()).proxy;
  const MechanicsModel mechanics = make_mechanics(proxy, {});
  const Poking poking(proxy);
  const auto deformer_of = [&](int iterations) {
    DeformOptions deform;
    deform.iterations = iterations;
    return Deformer(proxy, mechanics, {}, deform);
  };
  Deformer converged = deformer_of(kConverged);
  const Path truth = poked_path(converged, poking);
  double largest = 0;
  for (const auto& positions : truth)
    for (std::size_t v = 0; v < positions.size(); ++v)
      largest = std::max(largest, (positions[v] - proxy.vertices[v]).norm());
  for (const int iterations : {1, 2, 3, 4, 6, 8, 16}) {
    Deformer deformer = deformer_of(iterations);
    Path path;
    const Timing timing = bench.time([&] { path = poked_path(deformer, poking); });
    double moving = 0;
    for (std::size_t step = 0; step < path.size(); ++step)
      moving += mean_square(path[step], truth[step]) / double(path.size());
    bench.point("deformation step, 500 vertices, a probe pressed in and dragged", "organplay",
                of_one(timing, path.size()),
                {{"off the converged way, RMS", "% of the dent", 100 * std::sqrt(moving) / largest},
                 {"off the converged shape, held, RMS", "% of the dent",
                  100 * std::sqrt(mean_square(path.back(), truth.back())) / largest}},
                {{"iterations", "", double(iterations)}});
  }
}

// The skin that the proxy carries.
void promise_skin_bake(Bench& bench, const TriangleMesh& organ) {
  constexpr double kEdge_mm = 6;  // as bundles are baked
  for (const std::size_t faces : {80u, 300u, 1000u}) {
    bench.now("the smooth skin of " + std::to_string(faces) + " faces");
    const TriangleMesh proxy = decimate(organ, {.faces = faces}, bench.context()).proxy;
    const Timing bake =
        bench.time([&] { bake_smooth_skin(organ, proxy, kEdge_mm, bench.context()); });
    bench.at_most("the smooth skin of " + std::to_string(faces) + " faces: baked in", "ms",
                  bake.wall_ms.median, 300);
  }
}

void promise_deformation(Bench& bench) {
  const TriangleMesh organ = OrganPhantom({}).surface(bench.quick() ? 5 : 6);
  sweep_iterations(bench, organ);
  promise_step(bench, organ, 80, 0.02);
  promise_step(bench, organ, 80, 1, TissueSolver::fem);
  promise_step(bench, organ, 996, 0.2);
  if (!bench.quick()) promise_step(bench, organ, 9996, 3);
  promise_skin_bake(bench, bench.quick() ? OrganPhantom({}).surface(6) : organ);
}

const RegisteredPart kPlayerDeformation("player", promise_deformation);

}  // namespace
}  // namespace organbake
