// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/lighting.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/bundle/skin_image.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// A bundle with a smooth skin is of version 2, which older players refuse; one without is of
// version 1 and plays as ever.
inline constexpr const char* kBundleSchema = "organbake/bundle/1";
inline constexpr const char* kSkinnedBundleSchema = "organbake/bundle/2";

struct BundleFile {
  std::string path;  // relative, '/'-separated, inside the bundle
  std::uint64_t bytes = 0;
  std::string sha256;
};

struct Manifest {
  std::string name;
  std::string generator;    // program and version
  std::string recipe_json;  // the resolved recipe, an echo without paths of the machine
  std::vector<std::pair<std::string, std::string>> input_hashes;  // role → SHA-256
  std::vector<std::pair<std::string, std::uint64_t>> seeds;
  std::vector<BundleFile> files;    // every file but the manifest, in byte order of path
  std::vector<std::string> edited;  // paths that were changed by hand since the bake
};

// Lists and hashes what lies in `folder` and writes manifest.json there (last, so that a folder
// with a manifest is whole).
void write_manifest(const std::filesystem::path& folder, Manifest manifest);
Manifest manifest_from_json(const std::string& text, const std::string& name);
std::string manifest_to_json(const Manifest& manifest);

// The maps of one virtual camera, rows top first, all of the camera's size.
// Background: depth +inf, face kNoFace, color and confidence 0.
inline constexpr std::uint32_t kNoFace = 0xFFFFFFFFu;
struct CameraMaps {
  int width = 0, height = 0;
  std::vector<float> depth_mm;         // planar z, +inf where there is nothing
  std::vector<Eigen::Vector3f> color;  // scene-linear
  std::vector<float> height_mm;        // microstructure h over the face's prism
  std::vector<std::uint32_t> face;     // of the shell's surface (the skin or proxy), or kNoFace
  std::vector<float> confidence;       // 0…1: incidence and distance to a depth edge
};

// Of a size, all background.
CameraMaps background_maps(int width, int height);

// The folder of a camera's files inside a bundle: "cam_000".
std::string camera_folder(std::size_t camera);
// The maps as the images in that folder: depth.exr, color.exr and micro.exr.
ChannelImage depth_image(const CameraMaps& maps);
ChannelImage color_image(const CameraMaps& maps);
ChannelImage micro_image(const CameraMaps& maps);

struct Bundle {
  Manifest manifest;
  TriangleMesh proxy;
  CameraSet cameras;
  MechanicsModel mechanics;
  std::vector<CameraMaps> maps;  // one per camera; those not read yet are empty (width 0)
  BaseLayer base;
  std::optional<Lighting> lighting;  // that the colours were taken in, when it is known
  std::optional<SmoothSkin> skin;    // over the proxy; samples are then bound to it

  // What samples and base layer are bound to. Throws BadDataError when skin and proxy don't fit.
  ShellSurface shell() const { return ShellSurface(proxy, skin); }
};

// How many faces the shell's surface has: what maps and base layer number.
inline std::size_t shell_face_count(const Bundle& bundle) {
  return bundle.proxy.faces.size() * (bundle.skin ? bundle.skin->faces_per_proxy_face() : 1);
}

}  // namespace organbake
