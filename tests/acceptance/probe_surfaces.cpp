// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <cmath>

#include "odd_inputs.h"
#include "organbake/decimate/decimate.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/isosurface/isosurface.h"
#include "organbake/isosurface/label_surface.h"
#include "probes.h"

namespace organbake {
namespace {

// Balls, noise, constants and extremes on grids of any handedness and spacing.
Volume any_volume(RandomStream& random, int inside, int outside) {
  Volume volume;
  for (int& side : volume.size) side = 1 + int(random.below(24));
  const double voxel_mm = any_size(random, -2, 2);
  const double uneven = chance(random, 0.1) ? 2 : 0.5;  // powers of ten
  for (double& spacing : volume.spacing_mm) spacing = voxel_mm * any_size(random, -uneven, uneven);
  volume.origin_mm = any_point(random, 1e4);
  const Eigen::Vector3d x = any_direction(random), y = x.unitOrthogonal();
  volume.direction << x, y, (chance(random, 0.5) ? 1. : -1.) * x.cross(y);
  const std::uint64_t kind = random.below(4);
  const Eigen::Vector3d middle(0.5 * volume.size[0], 0.5 * volume.size[1], 0.5 * volume.size[2]);
  const double radius = middle.minCoeff() * random.uniform(0.3, 1.5);
  for (int k = 0; k < volume.size[2]; ++k)
    for (int j = 0; j < volume.size[1]; ++j)
      for (int i = 0; i < volume.size[0]; ++i) {
        const bool in = kind == 0   ? (Eigen::Vector3d(i, j, k) - middle).norm() < radius
                        : kind == 1 ? chance(random, 0.5)
                        : kind == 2 ? chance(random, 0.02)
                                    : true;
        volume.voxels.push_back(std::int16_t(in ? inside : outside));
      }
  if (chance(random, 0.05)) volume.spacing_mm[0] = odd_number(random);
  if (chance(random, 0.05)) volume.voxels.resize(volume.voxels.size() / 2);
  return volume;
}

bool sound(const TriangleMesh& mesh) {
  return analyse_topology(mesh).boundary_edges == 0 && signed_volume(mesh) > 0;
}

double probe_isosurface(RandomStream& random, const ProbeFolder&) {
  const int tissue =
      chance(random, 0.8) ? int(random.uniform(-999, 3000)) : int(random.uniform(-32768, 32767));
  const Volume ct = any_volume(random, tissue, -1000);
  IsosurfaceOptions options;
  options.iso_hu =
      chance(random, 0.8) ? random.uniform(-1000, tissue) : random.uniform(-33000, 33000);
  if (chance(random, 0.3)) options.iso_hu.reset();
  if (chance(random, 0.05)) options.iso_hu = odd_number(random);
  options.method =
      chance(random, 0.5) ? IsosurfaceMethod::flying_edges : IsosurfaceMethod::marching_cubes;
  options.refine = chance(random, 0.3);
  options.largest = random.below(3);
  options.taubin_steps = int(random.below(4));
  const TriangleMesh mesh = extract_isosurface(ct, options).mesh;
  check_mesh(mesh, "isosurface");
  expect_finite(mesh, "a vertex of the isosurface");
  double outside = 0;
  const Eigen::Vector3d size(ct.size[0], ct.size[1], ct.size[2]);
  for (const Eigen::Vector3d& v : mesh.vertices) {
    const Eigen::Vector3d index = ct.index_from_world(v);
    const Eigen::Vector3d beyond = (-index).cwiseMax(index - size);
    outside = std::max(outside, beyond.cwiseProduct(ct.spacing_mm).maxCoeff());
  }
  return sound(mesh) ? outside / (2 * ct.spacing_mm.maxCoeff()) : 2;
}

double probe_label_surface(RandomStream& random, const ProbeFolder&) {
  IsosurfaceOptions options;
  options.label = 1 + int(random.below(3));
  const Volume mask = any_volume(random, chance(random, 0.9) ? options.label : 4, 0);
  options.smooth_mm = chance(random, 0.1) ? odd_number(random) : random.uniform(0, 5);
  options.largest = 0;
  const TriangleMesh mesh = extract_label_surface(mask, options).mesh;
  check_mesh(mesh, "label surface");
  expect_finite(mesh, "a vertex of a mask's surface");
  std::size_t voxels = 0;
  for (const std::int16_t voxel : mask.voxels) voxels += voxel == options.label;
  const double wanted = double(voxels) * mask.spacing_mm.prod();
  return sound(mesh) ? std::abs(signed_volume(mesh) / wanted - 1) / 0.1 : 2;
}

double probe_decimate(RandomStream& random, const ProbeFolder&) {
  const TriangleMesh surface = any_organ(random);
  DecimateOptions options;
  options.method = DecimateMethod(random.below(4));
  options.faces = chance(random, 0.1) ? random.below(5) : 4 + random.below(200);
  options.objective = chance(random, 0.3) ? DecimateObjective::max : DecimateObjective::rms;
  if (chance(random, 0.05)) options.max_error_mm = any_size(random, -3, 2);
  const DecimateResult summary = decimate(surface, options);
  check_mesh(summary.proxy, "proxy");
  expect_finite(summary.proxy, "a vertex of the proxy");
  expect_finite(summary.rms_mm + summary.max_mm + summary.reverse_rms_mm, "the proxy's distance");
  if (options.max_error_mm <= 0 && summary.proxy.faces.size() > options.faces) return 2;
  const bool must_stay_whole = options.method != DecimateMethod::cluster;
  const bool torn = analyse_topology(surface).closed_manifold() &&
                    !analyse_topology(summary.proxy).closed_manifold();
  return must_stay_whole && torn ? 2 : 0;
}

}  // namespace

std::vector<Probe> surface_probes() {
  return {
      {"isosurface", "two voxels outside the volume; open or inward surfaces", probe_isosurface},
      {"mask", "a tenth of the label's volume", probe_label_surface},
      {"decimate", "a torn proxy, too many faces", probe_decimate},
  };
}

}  // namespace organbake
