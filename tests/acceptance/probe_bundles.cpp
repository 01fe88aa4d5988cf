// SPDX-License-Identifier: GPL-3.0-or-later

#include "measuring/agreement.h"
#include "measuring/scenes.h"
#include "organbake/capture/capture.h"
#include "organbake/capture/surface_color.h"
#include "organbake/decimate/decimate.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/shell.h"
#include "organbake/isosurface/isosurface.h"
#include "organbake/player/player.h"
#include "organbake/viewpoints/placement.h"
#include "probes.h"
#include "promises.h"
#include "support/testing.h"

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

double probe_isosurface(RandomStream& random) {
  const int tissue =
      chance(random, 0.8) ? int(random.uniform(-999, 3000)) : int(random.uniform(-32768, 32767));
  const Volume ct = any_volume(random, tissue, -1000);
  IsosurfaceOptions options;
  options.iso_hu =
      chance(random, 0.8) ? random.uniform(-1000, tissue) : random.uniform(-33000, 33000);
  if (chance(random, 0.3)) options.iso_hu.reset();
  if (chance(random, 0.05)) options.iso_hu = odd_number(random);
  options.refine = chance(random, 0.3);
  options.largest = random.below(3);
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

double probe_label_surface(RandomStream& random) {
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

}  // namespace

std::vector<Probe> surface_probes() {
  return {
      {"isosurface", "two voxels outside the volume; open or inward surfaces", probe_isosurface},
      {"mask", "a tenth of the label's volume", probe_label_surface},
  };
}

namespace {

TriangleMesh proxy_of(const TriangleMesh& surface, RandomStream& random) {
  DecimateOptions options;
  options.method = DecimateMethod::quadric;
  options.faces = 20 + random.below(60);
  return decimate(surface, options).proxy;
}

Bundle any_bundle(RandomStream& random) {
  const TriangleMesh surface = sound_organ(random);
  PlacementOptions options;
  options.count = 3 + int(random.below(5));
  options.map_size = 16 + int(random.below(32));
  return memory_bundle(surface, proxy_of(surface, random), options, {.rays_per_texel_side = 1});
}

// How far macro + micro lies from the surface that the depth map holds, beyond the last bit that a
// depth keeps.
double shell_error_mm(const TriangleMesh& proxy, const PosedCamera& camera,
                      const CameraMaps& maps) {
  const std::vector<ShellMatrix> shell = shell_matrices(proxy);
  double worst_mm = 0;
  for (std::size_t k = 0; k < maps.face.size(); ++k) {
    if (maps.face[k] == kNoFace) continue;
    const Eigen::Vector3d point = texel_point(camera, k, maps.depth_mm[k]);
    const Eigen::Vector3d bound = rejoined_point(shell.at(maps.face[k]), maps.height_mm[k], point);
    expect_finite(bound.sum() + maps.color[k].sum(), "a texel");
    const double stored_mm = std::ldexp(double(maps.depth_mm[k]), -17);
    worst_mm = std::max(worst_mm, (bound - point).norm() - stored_mm);
  }
  return worst_mm;
}

double probe_capture(RandomStream& random) {
  const TriangleMesh surface = any_organ(random);
  TriangleMesh proxy = chance(random, 0.7) ? proxy_of(surface, random) : any_organ(random);
  const double by = chance(random, 0.3) ? any_size(random, -1, 1) : 1;
  for (Eigen::Vector3d& vertex : proxy.vertices) vertex *= by;
  std::vector<PosedCamera> cameras;
  for (std::uint64_t i = random.below(4); i-- > 0;) {
    cameras.push_back(camera_round(random, bounds(surface), 1 + int(random.below(32))));
    if (chance(random, 0.05)) cameras.back().camera_from_world.translation = any_point(random, 100);
  }
  const CaptureOptions options{.rays_per_texel_side = 1 + int(random.below(3)),
                               .base_step_mm = any_size(random, 0, 2)};
  const auto color = surface.colors.empty() ? make_material_color({}) : make_vertex_color(surface);
  const CaptureResult captured = capture(surface, proxy, cameras, *color, options);
  expect_finite(captured.largest_height_mm, "the largest height");
  // Only a body has a shell in which every point lies; of others any finite binding is as good.
  const double edge = bounds(proxy).diagonal();
  const bool is_body = analyse_topology(proxy).closed_manifold() &&
                       std::abs(signed_volume(proxy)) > 1e-3 * edge * edge * edge;
  if (!is_body) return 0;
  double worst_mm = 0;
  for (std::size_t c = 0; c < cameras.size(); ++c)
    worst_mm = std::max(worst_mm, shell_error_mm(proxy, cameras[c], captured.maps[c]));
  Bounds scene = bounds(surface);
  for (const Eigen::Vector3d& v : proxy.vertices) scene.add(v);
  return worst_mm / (1e-6 * scene.diagonal());
}

double probe_warp(RandomStream& random) {
  const Bundle bundle = any_bundle(random);
  Warper warper(bundle), other(bundle);
  const Bounds box = bounds(bundle.proxy);
  double different = 0;
  Frame frame;
  for (int i = 0; i < 4; ++i) {
    View view;
    view.camera = camera_round(random, box, 1 + int(random.below(96)));
    if (chance(random, 0.3))  // from anywhere, the inside as well
      view.camera.camera_from_world.translation =
          random.uniform(0, box.diagonal()) * any_direction(random);
    if (chance(random, 0.05)) view.camera.intrinsics.fx = odd_number(random);
    view.near_mm = any_size(random, -3, 2);
    std::vector<Eigen::Vector3d> positions = bundle.proxy.vertices;
    for (std::uint64_t n = random.below(6); n-- > 0;)
      positions[random.below(positions.size())] += random.uniform(0, 60) * any_direction(random);
    if (chance(random, 0.03)) positions.back().x() = odd_number(random);
    DrawOptions options;
    options.keep_depth = true;
    Frame fresh;
    warper.draw(positions, view, options, frame);
    other.draw(positions, view, options, fresh);
    for (const float depth : frame.depth_mm)
      if (std::isnan(depth) || depth < 0) throw std::runtime_error("a depth behind the eye");
    different += count_different(frame.color.pixels, fresh.color.pixels);
  }
  return 2 * different;
}

}  // namespace

std::vector<Probe> bundle_probes() {
  return {
      {"capture", "a millionth of the scene between macro + micro and the surface", probe_capture},
      {"warp", "one byte between two drawings of one frame", probe_warp},
  };
}

}  // namespace organbake
