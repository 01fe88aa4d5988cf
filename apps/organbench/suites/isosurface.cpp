// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/isosurface/isosurface.h"

#include <cmath>

#include "bench.h"
#include "measuring/error_measures.h"
#include "organbake/phantom/ball_scan.h"
#include "organbake/phantom/phantom.h"
#include "peers/contours.h"

namespace organbake {
namespace {

constexpr double kRadius_mm = 40;
constexpr double kOrganIso_hu = -470;  // half-way between the phantom's tissue and air

// RMS over the vertices of their height above the phantom's formula.
double formula_rms_mm(const TriangleMesh& mesh, const OrganPhantom& phantom) {
  double squares = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) squares += std::pow(phantom.inside(v), 2);
  return std::sqrt(squares / double(mesh.vertices.size()));
}

IsosurfaceOptions at_level(double iso_hu, bool refine = false) {
  IsosurfaceOptions options;
  options.iso_hu = iso_hu;
  options.refine = refine;
  return options;
}

struct ContourMethod {
  std::string subject;
  bool peer;
  std::function<TriangleMesh()> surface;
};

// All of them on one CT; `error` tells how far a mesh is from the truth.
void compete(Bench& bench, const std::string& task, const Quantities& knobs,
             const std::vector<ContourMethod>& competitors,
             const std::function<double(const TriangleMesh&)>& error) {
  bench.now(task);
  std::vector<TriangleMesh> surfaces(competitors.size());
  std::vector<std::function<void()>> work;
  for (std::size_t c = 0; c < competitors.size(); ++c) {
    work.push_back([&, c] { surfaces[c] = competitors[c].surface(); });
  }
  const std::vector<Timing> timings = bench.time(work);
  for (std::size_t c = 0; c < competitors.size(); ++c) {
    bench.add(Point{task,
                    competitors[c].subject,
                    competitors[c].peer,
                    knobs,
                    timings[c],
                    {{"radial error, RMS", "mm", error(surfaces[c])}}});
  }
}

void sweep_voxels(Bench& bench) {
  const std::vector<double> sizes =
      bench.quick() ? std::vector{2.0, 1.0} : std::vector{3.0, 2.0, 1.4, 1.0, 0.7, 0.5};
  for (const double size : sizes) {
    const Volume ct = scan_ball(kRadius_mm, Eigen::Vector3d::Constant(size));
    const double level = std::ceil(kBallHalfWay_hu) - 0.5;
    compete(bench, "ball of 40 mm radius, cubic voxels", {{"voxel", "mm", size}},
            {{"organbake", false,
              [&] { return extract_isosurface(ct, at_level(kBallHalfWay_hu)).mesh; }},
             {"organbake --refine", false,
              [&] { return extract_isosurface(ct, at_level(kBallHalfWay_hu, true)).mesh; }},
             {"vtkMarchingCubes", true, [&] { return vtk_marching_cubes(ct, level); }}},
            [](const TriangleMesh& mesh) { return radial_rms_mm(mesh, kRadius_mm); });
  }
}

void promise_time_and_memory(Bench& bench) {
  OrganPhantomOptions options;
  options.ct_size = bench.quick() ? std::array{192, 192, 112} : std::array{512, 512, 300};
  options.spacing_mm = {0.7, 0.7, 1};
  const OrganPhantom phantom(options);
  bench.now("scanning the phantom");
  const Volume ct = phantom.scan(bench.context());
  const auto& [nx, ny, nz] = options.ct_size;
  const std::string task = "phantom, " + std::to_string(nx) + "×" + std::to_string(ny) + "×" +
                           std::to_string(nz) + " int16";
  bench.now(task);
  const double level = std::ceil(kOrganIso_hu) - 0.5;
  TriangleMesh mesh;
  const std::vector<Timing> timings = bench.time(std::vector<std::function<void()>>{
      [&] { mesh = extract_isosurface(ct, at_level(kOrganIso_hu)).mesh; },
      [&] { vtk_flying_edges_faces(ct, level); }, [&] { vtk_marching_cubes_faces(ct, level); }});
  const double error = formula_rms_mm(mesh, phantom);
  const Quantities faces = {{"faces", "", double(mesh.faces.size())}};
  const std::string height = "height above the formula, RMS";
  bench.point(task, "organbake", timings[0], {{height, "mm", error}}, faces);
  bench.peer(task, "vtkFlyingEdges3D alone", timings[1], {{height, "mm", error}}, faces);
  bench.peer(task, "vtkMarchingCubes alone", timings[2], {{height, "mm", error}}, faces);
  if (bench.quick()) return;  // what is promised is promised of the whole scan
  bench.at_most(task + ": time / vtkFlyingEdges3D alone", "×",
                timings[0].wall_ms.median / timings[1].wall_ms.median, 1.25);

  constexpr double kMb = double(1 << 20);
  const double mesh_mb =
      (mesh.vertices.size() * sizeof(Eigen::Vector3d) + mesh.faces.size() * sizeof(Face)) / kMb;
  const double volume_mb = ct.voxels.size() * sizeof(std::int16_t) / kMb;
  bench.at_most(task + ": memory beside the volume", "MB", timings[0].peak_mb,
                mesh_mb + 0.25 * (volume_mb + mesh_mb));
}

void run_isosurface(Bench& bench) {
  sweep_voxels(bench);
  promise_time_and_memory(bench);
}

const RegisteredSuite kIsosurface({"isosurface", "CT to surface: voxel size against radial error",
                                   run_isosurface});

}  // namespace
}  // namespace organbake
