// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/image/exr.h"

namespace organbake {

// How a bundle's images are packed. Every reader of EXR opens all of them.
struct MapPacking {
  ExrCompression compression = ExrCompression::zip;  // of all images, unless compact
  int zip_level = ExrWriteOptions().zip_level;       // 1…12; higher is smaller and slower
  // Small rather than exact: depth and microstructure as PXR24 (24 of a float's 32 bits, 0.002 mm
  // at 300 mm), colour as DWAA, which is made for pictures and must never touch depth.
  bool compact = false;
};

// Writes cam_…/depth.exr, color.exr, micro.exr of each camera, and base.exr, below an existing
// folder; images side by side, one thread each, because compressing takes most of the time. There
// must be as many maps as cameras. Throws IoError.
void write_map_files(const std::filesystem::path& folder, const std::vector<CameraMaps>& maps,
                     const std::vector<PosedCamera>& cameras, const BaseLayer& base,
                     const MapPacking& packing = {});

}  // namespace organbake
