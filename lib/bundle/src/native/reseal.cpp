// SPDX-License-Identifier: Apache-2.0
// Brings a bundle's manifest up to images that were edited by hand. Depth and microstructure name
// the same place in two ways; where an edit drives them more than a texel apart, it is refused,
// because pushed skin would jump there. And writes the images of all virtual cameras and the base
// layer, side by side on all threads, since compressing takes most of the time.
#include "organbake/bundle/bundle_reader.h"

#include <algorithm>
#include <initializer_list>

#include "organbake/bundle/stored_maps.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/sha256.h"
#include "organbake/core/text.h"
#include "organbake/geometry/shell.h"
#include "organbake/image/exr.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// Depth and height may name places this far apart, in widths of the texel: what shows least.
constexpr double kTexelsApart = 1;

bool named(const std::string& path, std::initializer_list<const char*> names) {
  return std::any_of(names.begin(), names.end(), [&](const char* name) {
    return path.starts_with("cam_") && path.ends_with(std::string("/") + name);
  });
}
bool may_change(const std::string& path) {
  return path == "base.exr" || named(path, {"color.exr", "depth.exr", "micro.exr"});
}

// The files that differ from the manifest, which is brought up to them.
std::vector<std::string> take_changes(const BundleReader& reader, Manifest& manifest) {
  std::vector<std::string> changed;
  for (BundleFile& file : manifest.files) {
    const std::vector<std::byte> bytes = reader.read_unchecked(file.path);
    const std::string sha256 = sha256_hex(bytes);
    if (sha256 == file.sha256) continue;
    if (!may_change(file.path)) {
      throw BadDataError(reader.folder() / file.path,
                         "was changed, and the maps were baked for it as it was: put it back or "
                         "bake the bundle anew (reseal takes changed cam_…/*.exr and base.exr)");
    }
    file = {file.path, bytes.size(), sha256};
    changed.push_back(file.path);
  }
  return changed;
}

// Depth is stored twice, for readers that know only one of the two names.
void check_depth_planes(const BundleReader& reader, const std::string& path) {
  const std::string name = (reader.folder() / path).string();
  const ChannelImage image = parse_exr(reader.read(path), name);
  if (!image.find("Z") || image.floats("Z", name) == image.floats("Y", name)) return;
  throw BadDataError(name +
                     ": its channels Y and Z hold the same depth, and now differ: edit both "
                     "alike, or leave Z out");
}

// Throws unless a camera's depth and heights tell the same places.
void check_places(const std::string& name, const CameraMaps& maps, const PosedCamera& camera,
                  const std::vector<ShellMatrix>& shells) {
  const RigidTransform world_from_camera = camera.camera_from_world.inverse();
  for (std::size_t i = 0; i < maps.face.size(); ++i) {
    if (maps.face[i] == kNoFace) continue;
    const std::size_t x = i % maps.width, y = i / maps.width;
    const double depth_mm = maps.depth_mm[i];
    const Eigen::Vector3d ray = unproject(camera.intrinsics, {x + 0.5, y + 0.5});
    const Eigen::Vector3d place = world_from_camera * (depth_mm * ray);
    const double apart_mm =
        (rejoined_point(shells[maps.face[i]], maps.height_mm[i], place) - place).norm();
    if (apart_mm <= kTexelsApart * depth_mm / camera.intrinsics.fx) continue;
    throw BadDataError(name + ": at texel (" + std::to_string(x) + ", " + std::to_string(y) +
                       ") depth.exr and micro.exr tell places " + to_text(apart_mm, 3) +
                       " mm apart; depths are edited by baking another surface");
  }
}

}  // namespace

ResealedBundle reseal(const fs::path& folder) {
  const BundleReader sealed(folder);
  ResealedBundle resealed{sealed.manifest(), {}};
  resealed.changed = take_changes(sealed, resealed.manifest);
  std::vector<std::string>& edited = resealed.manifest.edited;
  edited.insert(edited.end(), resealed.changed.begin(), resealed.changed.end());
  std::sort(edited.begin(), edited.end());
  edited.erase(std::unique(edited.begin(), edited.end()), edited.end());

  const BundleReader reader(folder, resealed.manifest);
  reader.verify();
  const Bundle bundle = reader.read_all();
  const std::vector<ShellMatrix> shells = shell_matrices(bundle.shell().at_rest());
  std::vector<char> moved(bundle.maps.size(), 0);
  for (const std::string& path : resealed.changed) {
    if (named(path, {"depth.exr"})) check_depth_planes(reader, path);
    for (std::size_t c = 0; c < moved.size(); ++c)
      if (path.starts_with(camera_folder(c) + "/") && named(path, {"depth.exr", "micro.exr"}))
        moved[c] = 1;
  }
  parallel_for(std::size_t{0}, moved.size(), [&](std::size_t c) {
    if (moved[c])
      check_places((folder / camera_folder(c)).string(), bundle.maps[c], bundle.cameras.cameras[c],
                   shells);
  });
  return resealed;
}

namespace {

ExrWriteOptions packed(const MapPacking& packing, ExrCompression when_compact) {
  return {.compression = packing.compact ? when_compact : packing.compression,
          .zip_level = packing.zip_level};
}

}  // namespace

void write_map_files(const std::filesystem::path& folder, const std::vector<CameraMaps>& maps,
                     const std::vector<PosedCamera>& cameras, const BaseLayer& base,
                     const MapPacking& packing) {
  for (std::size_t c = 0; c < cameras.size(); ++c) make_folder(folder / camera_folder(c));
  parallel_for(std::size_t{0}, 3 * cameras.size() + 1, [&](std::size_t i) {
    ExrWriteOptions exact = packed(packing, ExrCompression::pxr24);
    if (i == 3 * cameras.size())
      return write_exr(folder / "base.exr", base_layer_to_image(base), exact);
    const std::size_t c = i / 3;
    const std::filesystem::path camera = folder / camera_folder(c);
    ExrWriteOptions color = packed(packing, ExrCompression::dwaa);
    exact.camera = color.camera = cameras[c];
    if (i % 3 == 0) write_exr(camera / "depth.exr", depth_image(maps[c]), exact);
    if (i % 3 == 1) write_exr(camera / "color.exr", color_image(maps[c]), color);
    if (i % 3 == 2) write_exr(camera / "micro.exr", micro_image(maps[c]), exact);
  });
}

}  // namespace organbake
