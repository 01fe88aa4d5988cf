// SPDX-License-Identifier: Apache-2.0
// Reads a bundle from whatever holds its files, a folder or the pack of a web page, so that both go
// through the same checks. Maps may come from a stranger: what a renderer would index or divide by
// is looked at texel by texel.
#include "organbake/bundle/bundle_reader.h"

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/geometry/ply.h"

namespace organbake {
namespace {

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

Bundle read_frame(const BundleFiles& files, Manifest manifest) {
  Bundle bundle;
  bundle.manifest = std::move(manifest);
  const auto text = [&](const char* file) { return text_of(files.bytes(file)); };
  bundle.proxy = parse_ply(files.bytes("proxy.ply"), files.where("proxy.ply"));
  if (bundle.proxy.faces.empty()) throw BadDataError(files.where("proxy.ply") + ": has no faces");
  bundle.cameras = cameras_from_json(text("cameras.json"), files.where("cameras.json"));
  if (bundle.cameras.cameras.empty() ||
      bundle.cameras.manifold.directions.size() != bundle.cameras.cameras.size()) {
    throw BadDataError(files.where("cameras.json") +
                       ": needs cameras and their viewing projection manifold");
  }
  bundle.mechanics = mechanics_from_json(text("mechanics.json"), files.where("mechanics.json"),
                                         bundle.proxy.vertices.size());
  if (files.has(kSkinFile))
    bundle.skin = skin_from_image(files.image(kSkinFile), files.where(kSkinFile), bundle.proxy);
  bundle.base = base_layer_from_image(files.image("base.exr"), files.where("base.exr"),
                                      static_cast<std::uint32_t>(shell_face_count(bundle)));
  bundle.maps.resize(bundle.cameras.cameras.size());
  if (files.has(kLightingFile))
    bundle.lighting = lighting_from_json(text(kLightingFile), files.where(kLightingFile));
  return bundle;
}

void check_maps(const CameraMaps& maps, std::size_t faces, const std::string& folder) {
  const auto fail = [&](std::size_t i, const char* file, const char* what) {
    throw BadDataError(folder + "/" + file + ": texel (" + std::to_string(i % maps.width) + ", " +
                       std::to_string(i / maps.width) + ") " + what);
  };
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    if (maps.face[i] == kNoFace) continue;
    if (maps.face[i] >= faces) fail(i, "micro.exr", "names a face that the bundle does not have");
    if (!(maps.depth_mm[i] > 0) || !std::isfinite(maps.depth_mm[i])) {
      fail(i, "depth.exr", "has no finite positive depth");
    }
    if (!std::isfinite(maps.height_mm[i])) fail(i, "micro.exr", "has no finite height");
    if (!(maps.confidence[i] >= 0 && maps.confidence[i] <= 1)) {
      fail(i, "micro.exr", "has a confidence outside 0…1");
    }
    if (!maps.color[i].allFinite()) fail(i, "color.exr", "is not finite");
  }
}

}  // namespace organbake
