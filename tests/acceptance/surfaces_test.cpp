// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/isosurface/isosurface.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "measuring/scenes.h"
#include "organbake/core/random.h"
#include "organbake/core/text.h"
#include "organbake/decimate/mesh_distance.h"
#include "organbake/fusion/fuse_views.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/phantom.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/volume/read_volume.h"
#include "promises.h"
#include "support/files.h"

namespace organbake {
namespace {

// What the Image Biomarker Standardisation Initiative agreed on for a figure of its digital
// phantom.
struct Consensus {
  const char* what;
  const char* unit;
  double value, tolerance;
};

void add_beside(const Consensus& consensus, double ours) {
  const std::string what = "IBSI's digital phantom, consensus " + to_text(consensus.value) + " ± " +
                           to_text(consensus.tolerance) + ": " + consensus.what;
  const double most = consensus.value + consensus.tolerance;
  const double least = consensus.value - consensus.tolerance;
  expect({what + ", at most", consensus.unit, ours, most, Figure::Goal::at_most});
  expect({what + ", at least", consensus.unit, ours, least, Figure::Goal::at_least});
}

// Zwanenburg et al. 2020, The Image Biomarker Standardization Initiative, Radiology 295(2): the
// surface by marching cubes at one half, and what the voxels enclose.
TEST(Isosurface, OfIbsisPhantomIsWhatWasAgreedOn) {
  REQUIRE_SHARED_DATA("ibsi_digital_phantom/mask.nii.gz");
  const Volume mask =
      read_volume(shared_data("ibsi_digital_phantom/mask.nii.gz"), {.label = "1", .is_mask = true});
  add_beside({"volume of the voxels, by default", "mm³", 592, 4},
             signed_volume(extract_label_surface(mask, {}).mesh));
  IsosurfaceOptions textbook;
  textbook.method = IsosurfaceMethod::marching_cubes;
  textbook.smooth_mm = 0;
  textbook.largest = 0;
  textbook.keep_volume = false;
  const TriangleMesh mesh = extract_label_surface(mask, textbook).mesh;
  add_beside({"volume of the mesh", "mm³", 556, 4}, signed_volume(mesh));
  add_beside({"area of the mesh", "mm²", 388, 3}, surface_area(mesh));
  add_beside({"largest diameter", "mm", 13.1, 0.1}, largest_diameter_mm(mesh));
}

constexpr double kDepthNoise = 0.02, kOff_mm = 1, kOff_rad = 0.017453292519943295;

Plane depth_map(const RayScene& scene, const PosedCamera& camera, RandomStream& random) {
  const Intrinsics& k = camera.intrinsics;
  const RigidTransform world_from_camera = camera.camera_from_world.inverse();
  Plane depth(k.width, k.height, std::numeric_limits<float>::infinity());
  std::vector<Ray> rays(k.width);
  std::vector<RayHit> hits(k.width);
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x) {
      rays[x].origin = world_from_camera.translation;
      rays[x].direction = world_from_camera.rotation * unproject(k, {x + 0.5, y + 0.5});
    }
    scene.first_hits(rays, hits);
    for (int x = 0; x < k.width; ++x)
      if (hits[x].face != kNoHit)
        depth.at(x, y) = static_cast<float>(hits[x].t * (1 + kDepthNoise * random.normal()));
  }
  return depth;
}

std::vector<DepthView> noisy_views(const OrganPhantom& phantom, const RayScene& scene, bool off) {
  std::vector<DepthView> views;
  for (const PosedCamera& camera : phantom.photo_cameras()) {
    RandomStream random(1, views.size());
    DepthView view{"view " + std::to_string(views.size()),
                   camera,
                   depth_map(scene, camera, random),
                   {},
                   phantom.photograph(camera),
                   camera.intrinsics};
    RigidTransform& pose = view.camera.camera_from_world;
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(kOff_rad, random_direction(random)).toRotationMatrix();
    if (off) pose = RigidTransform{turn, kOff_mm * random_direction(random)} * pose;
    views.push_back(std::move(view));
  }
  return views;
}

// Root mean square distance of the vertices, and colour in dB, from the truth.
std::pair<double, double> off_truth(const TriangleMesh& mesh, const TriangleMesh& truth,
                                    const RayScene& scene) {
  double squares = 0, color_squares = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const ClosestPoint at = scene.closest_point(mesh.vertices[v]);
    squares += at.distance_mm * at.distance_mm;
    const std::uint32_t corner = truth.faces[at.face][0];
    for (int c = 0; c < 3; ++c)
      color_squares += std::pow(
          srgb_from_linear(mesh.colors[v][c]) - srgb_from_linear(truth.colors[corner][c]), 2);
  }
  const auto count = static_cast<double>(mesh.vertices.size());
  return {std::sqrt(squares / count), -10 * std::log10(color_squares / 3 / count)};
}

TEST(Fusion, OfNoisyDepthMapsIsNearTheSurface) {
  OrganPhantomOptions options;
  options.photo_count = 12;
  options.photo_size = 512;
  const OrganPhantom phantom(options);
  const TriangleMesh truth = phantom.surface(7);
  const RayScene scene(truth);
  for (const bool off : {false, true}) {
    const std::string poses = off ? "poses off by 1 mm, 1°, refined" : "exact poses";
    const FusedSurface fused = fuse_views(noisy_views(phantom, scene, off), {.refine = off});
    const auto [rms_mm, color_db] = off_truth(fused.mesh, truth, scene);
    const std::string what = "12 depth maps with 2 % noise, " + poses;
    expect({what + ": surface, RMS", "mm", rms_mm, off ? 0.6 : 0.3});
    expect({what + ": colour", "dB", color_db, 30, Figure::Goal::at_least});
  }
}

}  // namespace
}  // namespace organbake
