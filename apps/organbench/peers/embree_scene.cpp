// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/embree_scene.h"

#include <algorithm>

namespace organbake {

EmbreeScene::EmbreeScene(const TriangleMesh& mesh, bool moves) {
  vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                         RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                         mesh.vertices.size()));
  auto* faces = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.faces.size()));
  write_vertices(mesh.vertices);
  for (const Face& face : mesh.faces) faces = std::copy(face.begin(), face.end(), faces);
  if (moves) {
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_REFIT);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_DYNAMIC);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcCommitScene(scene);
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseGeometry(geometry);
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}

void EmbreeScene::write_vertices(const std::vector<Eigen::Vector3d>& positions) {
  for (std::size_t v = 0; v < positions.size(); ++v)
    for (int k = 0; k < 3; ++k) vertices[3 * v + k] = static_cast<float>(positions[v][k]);
}

}  // namespace organbake
