// SPDX-License-Identifier: GPL-3.0-or-later
// CT to surface: how far a ball's surface lies from the ball for voxels of several sizes, beside
// VTK's marching cubes; and time and memory of a whole scan, beside VTK's flying edges.
#include "organbake/isosurface/isosurface.h"

#include <cmath>

#include "bench.h"
#include "organbake/phantom/known_answers.h"
#include "organbake/phantom/phantom.h"
#include "peers/peers.h"

namespace organbake {
namespace {

constexpr double kRadius_mm = 40;
constexpr double kOrganIso_hu = -470;  // half-way between the phantom's tissue and air

// RMS over the vertices of their distance to a sphere round the origin.
double radial_rms_mm(const TriangleMesh& mesh, double radius_mm) {
  double squares = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) squares += std::pow(v.norm() - radius_mm, 2);
  return std::sqrt(squares / double(mesh.vertices.size()));
}

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

void sweep_voxels(Bench& bench) {
  const std::string task = "ball of 40 mm radius, cubic voxels";
  const std::vector<double> sizes =
      bench.quick() ? std::vector{2.0, 1.0} : std::vector{3.0, 2.0, 1.4, 1.0, 0.7, 0.5};
  for (const double size : sizes) {
    bench.now(task);
    const Volume ct = scan_ball(kRadius_mm, Eigen::Vector3d::Constant(size));
    const double level = std::ceil(kBallHalfWay_hu) - 0.5;
    TriangleMesh plain, refined, by_vtk;
    const std::vector<Timing> timings = bench.time(std::vector<std::function<void()>>{
        [&] { plain = extract_isosurface(ct, at_level(kBallHalfWay_hu)).mesh; },
        [&] { refined = extract_isosurface(ct, at_level(kBallHalfWay_hu, true)).mesh; },
        [&] { by_vtk = vtk_marching_cubes(ct, level); }});
    const auto error = [](const TriangleMesh& mesh) {
      return Quantities{{"radial error, RMS", "mm", radial_rms_mm(mesh, kRadius_mm)}};
    };
    const Quantities voxel = {{"voxel", "mm", size}};
    bench.point(task, "organbake", timings[0], error(plain), voxel);
    bench.point(task, "organbake --refine", timings[1], error(refined), voxel);
    bench.add({task, "vtkMarchingCubes", true, voxel, timings[2], error(by_vtk)});
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
      [&] { vtk_flying_edges_faces(ct, level); }});
  const double error = formula_rms_mm(mesh, phantom);
  const Quantities faces = {{"faces", "", double(mesh.faces.size())}};
  const std::string height = "height above the formula, RMS";
  bench.point(task, "organbake", timings[0], {{height, "mm", error}}, faces);
  bench.add({task, "vtkFlyingEdges3D alone", true, faces, timings[1], {{height, "mm", error}}});
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

const RegisteredPart kIsosurface("isosurface", run_isosurface,
                                 "CT to surface: voxel size against radial error");

}  // namespace
}  // namespace organbake
