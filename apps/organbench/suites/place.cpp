// SPDX-License-Identifier: GPL-3.0-or-later
// Cameras round a surface: what those that are found for a coverage see of it, beside as many that
// are spread evenly.
#include <algorithm>

#include "bench.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/phantom/phantom.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {
namespace {

const std::string kUnseen = "reachable area seen by fewer than 2 cameras";

struct NamedSurface {
  std::string name;
  TriangleMesh mesh;
};

std::vector<NamedSurface> surfaces(Bench& bench) {
  std::vector<NamedSurface> all;
  const int subdivisions = bench.quick() ? 5 : 6;
  all.push_back({"phantom", OrganPhantom({}).surface(subdivisions)});
  if (bench.quick()) {
    bench.skip("the real livers", "--quick");
    return all;
  }
  for (const auto& [name, file] :
       {std::pair{"liver", "mesh/liver/liver.vtk"},
        std::pair{"liver H07", "registration/rendered_liver/liver-H07.ply"}}) {
    const auto path = bench.data(file);
    if (!path.empty()) all.push_back({name, read_mesh(path)});
  }
  return all;
}

struct PlaceOutcome {
  Placement placement;
  CoverageReport coverage;
  Timing timing;
};

PlaceOutcome place(Bench& bench, const NamedSurface& surface, const PlacementOptions& options,
                   const std::string& subject, bool peer) {
  bench.now(surface.name + ", " + subject);
  PlaceOutcome outcome;
  outcome.timing = bench.time([&] { outcome.placement = place_cameras(surface.mesh, options); });
  outcome.coverage = measure_coverage(surface.mesh, outcome.placement, options);
  const double count = static_cast<double>(outcome.placement.cameras.size());
  const Quantities errors = {{kUnseen, "%", 100 * (1 - outcome.coverage.seen_share[1])},
                             {"views miss, mean", "%", 100 * outcome.coverage.at_rest.mean_gap}};
  const Quantities knobs = {{"cameras", "", count}};
  bench.add(Point{surface.name + ", " + std::to_string(surface.mesh.faces.size()) + " faces",
                  subject, peer, knobs, outcome.timing, errors});
  return outcome;
}

void promise(Bench& bench, const NamedSurface& surface, const PlaceOutcome& ours) {
  bench.at_least(surface.name + ": reachable area seen by 2 cameras", "%",
                 100 * ours.coverage.seen_share[1], 99.5);
  bench.at_most(surface.name + ": views miss, mean at rest", "%",
                100 * ours.coverage.at_rest.mean_gap, 0.1);
  constexpr std::size_t kPromised = 80'000;
  if (surface.mesh.faces.size() < kPromised) return;
  bench.at_most(surface.name + ": placement, wall", "s", ours.timing.wall_ms.median / 1e3, 1);
}

void sweep(Bench& bench, const NamedSurface& surface) {
  const PlaceOutcome ours =
      place(bench, surface, {.coverage = CoverageGoal{}}, "organbake --coverage 0.995", false);
  promise(bench, surface, ours);
  const int found = static_cast<int>(ours.placement.cameras.size());
  std::vector<int> counts = {8, 12, 16, 24, 32, 48, found};
  std::sort(counts.begin(), counts.end());  // for the curve's sake
  for (const int count : counts) {
    place(bench, surface, {.count = count}, "evenly spread", true);
  }
}

void run_place(Bench& bench) {
  for (const NamedSurface& surface : surfaces(bench)) sweep(bench, surface);
}

const RegisteredPart kPlace("place", run_place,
                            "surface to cameras: how many against what they see");

}  // namespace
}  // namespace organbake
