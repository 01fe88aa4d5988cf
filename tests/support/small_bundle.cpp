// SPDX-License-Identifier: Apache-2.0
#include "support/synthetic_bundle.h"

#include <limits>

#include "organbake/core/files.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/exr.h"
#include "support/meshes.h"

namespace organbake {
namespace {

CameraMaps maps_of(const Intrinsics& k) {
  CameraMaps maps;
  maps.width = k.width;
  maps.height = k.height;
  for (int i = 0; i < k.width * k.height; ++i) {
    const bool there = i % 4 != 0;
    maps.depth_mm.push_back(there ? 9.5f + 0.01f * i : std::numeric_limits<float>::infinity());
    maps.color.emplace_back(there ? 0.5f : 0, there ? 0.25f : 0, 0);
    maps.height_mm.push_back(there ? 0.125f * (i % 3) : 0);
    maps.face.push_back(there ? i % 4 : kNoFace);
    maps.confidence.push_back(there ? 0.75f : 0);
  }
  return maps;
}

}  // namespace

Bundle small_bundle() {
  Bundle bundle;
  bundle.manifest.name = "small";
  bundle.manifest.generator = "tests";
  bundle.proxy = tetrahedron_mesh();
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0, -10, 0), Eigen::Vector3d(10, 0, 0)}) {
    bundle.cameras.cameras.push_back(
        {"v", {8, 6, 10, 10, 4, 3}, look_at(eye, {0, 0, 0}, Eigen::Vector3d::UnitZ())});
    bundle.cameras.manifold.directions.push_back(eye.normalized());
    bundle.maps.push_back(maps_of(bundle.cameras.cameras.back().intrinsics));
  }
  bundle.mechanics = {
      {0.1, 0.1, 0.1, 0.1}, {{0, 1, 1, 2, 0.5}, {2, 3, 1.5, 2, 0}}, {0}, {}, 10, 1060, 15, 1, 5};
  bundle.base = {2, 4, std::vector<float>(24, 0.5f),
                 std::vector<Eigen::Vector3f>(24, {0.5f, 0.25f, 0.125f}),
                 std::vector<std::uint32_t>(24, 3)};
  return bundle;
}

TetrahedralBody small_body() {
  TetrahedralBody body;
  body.nodes_mm = {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {0, 0, 3}, {3, 3, 3.1}};
  body.tetrahedra = {{{0, 1, 2, 3}, 0.25}, {{1, 2, 3, 4}, 1}};
  body.vertices = {{0, {1, 0, 0, 0}},
                   {0, {0.1, 0.2, 0.3, 0.4}},
                   {1, {0.25, 0.25, 0.25, 0.25}},
                   {1, {0, 0, 0, 1}}};
  body.anchors = {0, 3};
  body.poisson_ratio = 0.3;
  body.damping_s = 0.01;
  return body;
}

void write_bundle(const std::filesystem::path& folder, const Bundle& bundle) {
  std::filesystem::create_directories(folder);
  write_ply(folder / "proxy.ply", bundle.proxy);
  write_file_atomically(folder / "cameras.json", cameras_to_json(bundle.cameras));
  write_file_atomically(folder / "mechanics.json", mechanics_to_json(bundle.mechanics));
  write_exr(folder / "base.exr", base_layer_to_image(bundle.base));
  if (bundle.skin) write_exr(folder / kSkinFile, skin_to_image(*bundle.skin));
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    const auto camera = folder / camera_folder(c);
    std::filesystem::create_directories(camera);
    write_exr(camera / "depth.exr", depth_image(bundle.maps[c]));
    write_exr(camera / "color.exr", color_image(bundle.maps[c]));
    write_exr(camera / "micro.exr", micro_image(bundle.maps[c]));
  }
  write_manifest(folder, bundle.manifest);
}

}  // namespace organbake
