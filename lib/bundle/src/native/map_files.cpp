// SPDX-License-Identifier: Apache-2.0
// Writes the images of all virtual cameras and the base layer, side by side on all threads, since
// compressing takes most of the time.
#include "organbake/bundle/stored_maps.h"

#include "organbake/core/files.h"
#include "organbake/core/parallel.h"

namespace organbake {
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
