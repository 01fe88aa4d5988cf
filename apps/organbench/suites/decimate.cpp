// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces to proxies of so many faces: distances both ways and time, beside CGAL's Lindstrom–Turk,
// OpenMesh, VTK and meshoptimizer, on phantoms and the shared livers.
#include "organbake/decimate/decimate.h"

#include <algorithm>

#include "bench.h"
#include "organbake/decimate/mesh_measures.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/refine.h"
#include "organbake/phantom/phantom.h"
#include "organbake/raycast/ray_scene.h"
#include "peers/peers.h"

namespace organbake {
namespace {

using Reduce = std::function<TriangleMesh(const TriangleMesh&, std::size_t faces)>;

struct Competitor {
  std::string subject;
  bool peer;
  Reduce reduce;
};

Reduce fitted(bool flips) {
  return [flips](const TriangleMesh& surface, std::size_t faces) {
    return decimate(surface, {.faces = faces, .flips = flips}).proxy;
  };
}

const Competitor kFitted{"organbake fitted", false, fitted(true)};
const Competitor kNoFlips{"organbake fitted, no flips", false, fitted(false)};
// The collapse alone: none of our checks, no measuring.
const Competitor kLindstromTurk{
    "CGAL Lindstrom–Turk", true,
    [](const TriangleMesh& s, std::size_t faces) { return collapse_edges(s, faces, {}); }};
const Competitor kOpenMesh{"OpenMesh quadric", true, [](const TriangleMesh& s, std::size_t faces) {
                             return collapse_by_quadrics(s, faces, {});
                           }};
const Competitor kVtk{"vtkQuadricDecimation", true, vtk_quadric_decimation};
const Competitor kMeshoptimizer{"meshoptimizer", true, meshoptimizer_simplify};

// Both ways, over even samples of many more than the fit itself looks at.
struct Distances {
  MeshDistance there, back;
  double volume_change = 0;

  double rms_mm() const { return std::max(there.rms_mm, back.rms_mm); }
  double max_mm() const { return std::max(there.max_mm, back.max_mm); }
};

Distances distances(const TriangleMesh& surface, const TriangleMesh& proxy) {
  constexpr std::size_t kSamples = 200'000;
  constexpr std::uint64_t kSeed = 20'26;
  return {mesh_distance(surface, RayScene(proxy), kSamples, kSeed),
          mesh_distance(proxy, RayScene(surface), kSamples, kSeed + 1),
          signed_volume(proxy) / signed_volume(surface) - 1};
}

struct Outcome {
  Timing timing;
  Distances distances;
};

// All competitors reduce one surface; a point for each.
std::vector<Outcome> compete(Bench& bench, const std::string& name, const TriangleMesh& surface,
                             std::size_t faces, const std::vector<Competitor>& competitors) {
  const std::string task =
      name + ", " + std::to_string(surface.faces.size()) + " faces → " + std::to_string(faces);
  bench.now(task);
  std::vector<TriangleMesh> proxies(competitors.size());
  std::vector<std::function<void()>> work;
  for (std::size_t c = 0; c < competitors.size(); ++c) {
    work.push_back([&, c] { proxies[c] = competitors[c].reduce(surface, faces); });
  }
  const std::vector<Timing> timings = bench.time(work);
  const double diagonal = bounds(surface).diagonal();
  std::vector<Outcome> outcomes;
  for (std::size_t c = 0; c < competitors.size(); ++c) {
    const Distances d = distances(surface, proxies[c]);
    const auto share = [&](double mm) { return 100 * mm / diagonal; };
    bench.add(
        Point{task,
              competitors[c].subject,
              competitors[c].peer,
              {{"faces", "", double(proxies[c].faces.size())}},
              timings[c],
              {{"distance, RMS, worse way", "% of the diagonal", share(d.rms_mm())},
               {"distance, largest", "% of the diagonal", share(d.max_mm())},
               {"volume change", "%", 100 * d.volume_change},
               {"closed manifold", "", double(analyse_topology(proxies[c]).closed_manifold())}}});
    outcomes.push_back({timings[c], d});
  }
  return outcomes;
}

void promise(Bench& bench, const std::string& what, const Outcome& ours, const Outcome& peer,
             double rms_ratio, double max_ratio) {
  const Distances &a = ours.distances, &b = peer.distances;
  bench.at_most(what + ": RMS / Lindstrom–Turk's, surface to proxy", "×",
                a.there.rms_mm / b.there.rms_mm, rms_ratio);
  bench.at_most(what + ": RMS / Lindstrom–Turk's, proxy to surface", "×",
                a.back.rms_mm / b.back.rms_mm, rms_ratio);
  if (max_ratio > 0) {
    bench.at_most(what + ": largest / Lindstrom–Turk's, both ways", "×", a.max_mm() / b.max_mm(),
                  max_ratio);
  }
  bench.at_most(what + ": volume change", "%", 100 * std::abs(a.volume_change), 0.5);
}

double cpu_ratio(const Outcome& a, const Outcome& b) {
  return a.timing.cpu_ms.median / b.timing.cpu_ms.median;
}

void eighty_faces(Bench& bench, const std::string& name, const TriangleMesh& surface) {
  const auto out = compete(bench, name, surface, 80,
                           {kNoFlips, kFitted, kLindstromTurk, kOpenMesh, kVtk, kMeshoptimizer});
  if (bench.quick()) return;  // no promises: they are made of the whole organs
  const std::string what = name + " → 80";
  promise(bench, what + ", no flips", out[0], out[2], 0.80, 1.0);
  // Small surfaces leave Lindstrom–Turk little to do: the time is promised for large ones.
  constexpr std::size_t kLarge = 80'000;
  const bool large = surface.faces.size() >= kLarge;
  if (large) {
    bench.at_most(what + ", no flips: CPU / Lindstrom–Turk's", "×", cpu_ratio(out[0], out[2]),
                  0.37);
  }
  promise(bench, what, out[1], out[2], 0.68, 0.9);
  if (large) bench.at_most(what + ": CPU", "s", out[1].timing.cpu_ms.median / 1e3, 1.5);
}

void million_faces(Bench& bench, const TriangleMesh& surface) {
  const auto out =
      compete(bench, "phantom", surface, 80, {kFitted, kLindstromTurk, kVtk, kMeshoptimizer});
  const std::string what = "phantom of 1.3 million faces → 80";
  promise(bench, what, out[0], out[1], 0.70, 0);
  bench.at_most(what + ": CPU", "s", out[0].timing.cpu_ms.median / 1e3, 2.5);
}

void sphere(Bench& bench) {
  constexpr double kRadius_mm = 100;
  TriangleMesh surface = make_icosphere(5);
  for (Eigen::Vector3d& v : surface.vertices) v *= kRadius_mm;
  const auto out = compete(bench, "sphere", surface, 80, {kFitted, kLindstromTurk});
  bench.at_most("sphere → 80: RMS", "% of R", out[0].distances.rms_mm(), 1.27);
}

void sweep_faces(Bench& bench, const TriangleMesh& surface) {
  for (const std::size_t faces : {40, 160, 320, 640, 1280, 5000}) {
    compete(bench, "phantom", surface, faces, {kFitted, kLindstromTurk, kVtk, kMeshoptimizer});
  }
}

void run_decimate(Bench& bench) {
  const OrganPhantom phantom{OrganPhantomOptions{}};
  const TriangleMesh organ = phantom.surface(bench.quick() ? 4 : 6);
  eighty_faces(bench, "phantom", organ);
  if (bench.quick()) return;
  sweep_faces(bench, organ);
  for (const char* name : {"liver", "liver_tumours"}) {
    const auto file = bench.data(std::string("mesh/liver/") + name + ".vtk");
    if (!file.empty()) eighty_faces(bench, name, read_mesh(file));
  }
  sphere(bench);
  million_faces(bench, phantom.surface(8));
}

const RegisteredPart kDecimate("decimate", run_decimate,
                               "surface to proxy: faces and method against distance");

}  // namespace
}  // namespace organbake
