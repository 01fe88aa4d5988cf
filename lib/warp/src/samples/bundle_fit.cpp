// SPDX-License-Identifier: Apache-2.0
#include "samples/bundle_fit.h"

#include <string>

#include "organbake/core/error.h"

namespace organbake {

void check_maps_fit(const CameraMaps& m, std::size_t camera, const Intrinsics& k,
                    std::size_t faces) {
  const std::size_t texels = std::size_t(k.width) * k.height;
  if (m.width != k.width || m.height != k.height || m.depth_mm.size() != texels ||
      m.color.size() != texels || m.height_mm.size() != texels || m.face.size() != texels ||
      m.confidence.size() != texels) {
    throw BadDataError("bundle: the maps of camera " + std::to_string(camera) +
                       " do not fit its size");
  }
  for (const std::uint32_t face : m.face) {
    if (face != kNoFace && face >= faces) {
      throw BadDataError("bundle: camera " + std::to_string(camera) + " names face " +
                         std::to_string(face) + ", the bundle has " + std::to_string(faces));
    }
  }
}

void check_positions(const std::vector<Eigen::Vector3d>& positions, const TriangleMesh& proxy) {
  if (positions.size() != proxy.vertices.size()) {
    throw BadDataError("draw: " + std::to_string(positions.size()) + " positions for a proxy of " +
                       std::to_string(proxy.vertices.size()) + " vertices");
  }
  for (const Eigen::Vector3d& p : positions) {
    if (!p.allFinite()) throw BadDataError("draw: a proxy vertex is not finite");
  }
}

void check_fit(const Bundle& bundle) {
  const std::size_t cameras = bundle.cameras.cameras.size(), faces = shell_face_count(bundle);
  if (bundle.maps.size() != cameras || bundle.cameras.manifold.directions.size() != cameras) {
    throw BadDataError("bundle: cameras, maps and viewing manifold differ in number");
  }
  const BaseLayer& b = bundle.base;
  const std::size_t nodes = std::size_t(b.face_count) * b.nodes_per_face();
  if (b.face_count != 0 && (b.face_count != faces || b.steps < 1 || b.height_mm.size() != nodes ||
                            b.color.size() != nodes || b.seen_by.size() != nodes)) {
    throw BadDataError("bundle: the base layer does not fit the proxy or its skin");
  }
}

}  // namespace organbake
