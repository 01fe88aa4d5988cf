// SPDX-License-Identifier: GPL-3.0-or-later
// How each stage's time grows with its main size, as an exponent (the slope of log time over log
// size); and how much faster eight threads can bake at least, by the longest chain of work.
#include <cmath>
#include <memory>

#include "bench.h"
#include "measuring/scenes.h"
#include "organbake/capture/capture.h"
#include "organbake/capture/surface_color.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/decimate/decimate.h"
#include "organbake/deform/deformer.h"
#include "organbake/isosurface/isosurface.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/phantom/known_answers.h"
#include "organbake/phantom/phantom.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/shading/shape_from_shading.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {
namespace {

// A stage's work in its main size, and how to do it.
struct Load {
  double size;
  std::function<void()> work;
};

struct Growth {
  std::string stage, unit;
  std::vector<Load> loads;  // growing
  bool solves = false;      // with a sparse factor, whose fill is n log n at best
};

// The slope of log time over log size, by least squares.
double exponent_of(const std::vector<double>& sizes, const std::vector<double>& times) {
  const double n = double(sizes.size());
  double x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double u = std::log(sizes[i]), v = std::log(times[i]);
    x += u, y += v, xx += u * u, xy += u * v;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

void measure(Bench& bench, const Growth& growth) {
  const ThreadLimit one(1);
  std::vector<double> sizes, times;
  for (const Load& load : growth.loads) {
    bench.now(growth.stage + ", " + std::to_string(long(load.size)) + " " + growth.unit);
    const Timing timing = bench.time(load.work);
    bench.point(growth.stage + ", one thread", "organbake", timing, {},
                {{growth.unit, "", load.size}});
    sizes.push_back(load.size);
    times.push_back(timing.cpu_ms.median);
  }
  std::string what = growth.stage + ": time grows with " + growth.unit + " to the power of";
  if (growth.solves) {
    std::vector<double> fill;
    for (const double n : sizes) fill.push_back(n * std::log(n));
    what += " (n log n, the least that a sparse factor of a mesh fills: " +
            to_text(exponent_of(sizes, fill), 3) + ")";
  }
  bench.at_most(what, "", exponent_of(sizes, times), 1.1);
}

// How much faster than one eight threads can be at least, counted whatever this machine has: stage
// by stage, and a bake of them all. Loops of Embree, VTK and OpenCV count for less than they can
// do: as chains of the thread that asks for them.
class CriticalPath {
 public:
  explicit CriticalPath(Bench& bench) : bench_(bench) {}

  void add(const std::string& stage, const std::function<void()>& work) {
    bench_.now(stage + ", its critical path");
    const ThreadLimit eight(kThreads);
    WorkMeter meter;
    work();
    const WorkSpan span = meter.lap();
    bench_.point(stage + ", by its critical path", "organbake", {},
                 {{"8 threads beside one", "×", speedup(span)}},
                 {{"work", "ms", span.work_ms}, {"longest chain", "ms", span.span_ms}});
    bake_.work_ms += span.work_ms, bake_.span_ms += span.span_ms;
  }
  void tell_bake() const {
    bench_.at_least("the bake: " + to_text(bake_.work_ms, 0) +
                        " ms of work with a longest chain of " + to_text(bake_.span_ms, 0) +
                        " ms; 8 threads beside one",
                    "×", speedup(bake_), 5);
  }

 private:
  static constexpr int kThreads = 8;
  static double speedup(const WorkSpan& span) {  // Brent 1974
    return span.work_ms / (span.work_ms / kThreads + span.span_ms);
  }

  Bench& bench_;
  WorkSpan bake_;
};

Growth isosurface_growth(bool quick) {
  Growth growth{"isosurface", "voxels", {}};
  for (const double spacing_mm : quick ? std::vector{2.0, 1.0} : std::vector{2.0, 1.0, 0.5}) {
    const Volume ct = scan_ball(40, Eigen::Vector3d::Constant(spacing_mm));
    IsosurfaceOptions options;
    options.iso_hu = kBallHalfWay_hu;
    growth.loads.push_back(
        {double(ct.voxel_count()), [ct, options] { extract_isosurface(ct, options); }});
  }
  return growth;
}

// Stages whose main size is the surface's faces.
std::vector<Growth> face_growths(bool quick) {
  std::vector<Growth> growths = {{"decimate, fitted, to 80 faces", "faces", {}},
                                 {"decimate, quadric, to 80 faces", "faces", {}},
                                 {"place, 8 cameras", "faces", {}}};
  for (int subdivisions = 3; subdivisions <= (quick ? 4 : 6); ++subdivisions) {
    const TriangleMesh surface = OrganPhantom({}).surface(subdivisions);
    const double faces = double(surface.faces.size());
    for (const auto& [at, method] :
         {std::pair{0, DecimateMethod::fitted}, std::pair{1, DecimateMethod::quadric}}) {
      const DecimateOptions options{.method = method};
      growths[std::size_t(at)].loads.push_back(
          {faces, [surface, options] { decimate(surface, options); }});
    }
    growths[2].loads.push_back({faces, [surface] { place_cameras(surface, {}); }});
  }
  return growths;
}

PlacementOptions even_cameras(int count, int map_size) {
  return {.count = count, .map_size = map_size};
}

// Placed beforehand: what is timed is capture alone.
std::function<void()> capture_work(const TriangleMesh& surface, const TriangleMesh& proxy,
                                   const PlacementOptions& placement) {
  return [&surface, &proxy, cameras = place_cameras(surface, placement).cameras] {
    capture(surface, proxy, cameras, *make_vertex_color(surface), {});
  };
}

Growth capture_growth(const TriangleMesh& surface, const TriangleMesh& proxy, bool quick) {
  Growth growth{"capture", "texels", {}};
  for (const int side : quick ? std::vector{64, 128} : std::vector{128, 256, 512, 1024}) {
    growth.loads.push_back(
        {4.0 * side * side, capture_work(surface, proxy, even_cameras(4, side))});
  }
  return growth;
}

Growth shade_growth(bool quick) {
  Growth growth{"shade, laparoscope", "pixels", {}};
  for (const int side : quick ? std::vector{64, 128} : std::vector{64, 128, 256, 512}) {
    const NearScene scene = near_scene(0.5, side);
    growth.loads.push_back({double(side) * side, [scene, side] {
                              shade_laparoscope(scene.intensity, Mask(side, side, 1), scene.camera,
                                                {});
                            }});
  }
  return growth;
}

Growth frame_growth(Player& player, bool quick) {
  Growth growth{"frame", "pixels", {}};
  for (const int height : quick ? std::vector{180, 360} : std::vector{180, 360, 720, 1440}) {
    const int width = height * 16 / 9;
    const View view = orbit_view(player.bundle().cameras, {0.3, 0.1}, width, height);
    growth.loads.push_back({double(width) * height, [&player, view] {
                              Frame frame;  // a new one: nothing to build on
                              player.draw(view, {.light = DrawnLight::baked}, frame);
                            }});
  }
  return growth;
}

Growth step_growth(bool quick) {
  Growth growth{"deformation step", "vertices", {}, true};
  for (int subdivisions = 1; subdivisions <= (quick ? 2 : 4); ++subdivisions) {
    const TriangleMesh proxy = OrganPhantom({}).surface(subdivisions);
    auto deformer =
        std::make_shared<Deformer>(proxy, make_mechanics(proxy, {}), BaseLayer{}, DeformOptions{});
    Instrument tip;
    tip.active = true;
    tip.position_mm = 0.95 * proxy.vertices.front();
    growth.loads.push_back({double(proxy.vertices.size()), [deformer, tip]() mutable {
                              for (int step = 0; step < 50; ++step) {
                                tip.position_mm *= step % 2 ? 1.001 : 0.999;
                                deformer->step({tip});
                              }
                            }});
  }
  return growth;
}

void run_scaling(Bench& bench) {
  const bool quick = bench.quick();
  measure(bench, isosurface_growth(quick));
  for (const Growth& growth : face_growths(quick)) measure(bench, growth);
  const TriangleMesh surface = OrganPhantom({}).surface(quick ? 4 : 6);
  const TriangleMesh proxy = decimate(surface, {}).proxy;
  measure(bench, capture_growth(surface, proxy, quick));
  measure(bench, shade_growth(quick));
  const int map_size = quick ? 128 : 512;
  Player player(memory_bundle(surface, proxy, even_cameras(4, map_size)));
  measure(bench, frame_growth(player, quick));
  measure(bench, step_growth(quick));

  const PlacementOptions twelve = even_cameras(12, map_size);
  CriticalPath path(bench);
  path.add("isosurface", isosurface_growth(quick).loads.back().work);
  path.add("decimate, fitted", [&] { decimate(surface, {}); });
  path.add("mechanics", [&] { make_mechanics(proxy, {}); });
  path.add("place, 12 cameras", [&] { place_cameras(surface, twelve); });
  path.add("capture, 12 cameras", capture_work(surface, proxy, twelve));
  path.tell_bake();
}

const RegisteredPart kScaling(
    "scaling", run_scaling,
    "time against work: the exponent of every stage's main size, and the bake's longest chain");

}  // namespace
}  // namespace organbake
