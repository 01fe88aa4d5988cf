// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/image/exr.h"

namespace organbake {

// A camera's maps as the player takes them, in a form that deflate packs well: each texel in use is
// told by how it differs from what its neighbours foretell. Colour and confidence come back as the
// bytes that a player makes of them anyway (255·√linear; 255 = sure), faces exactly, depth and
// height to a 128th of a texel of maps of 512 pixels a side or more, of smaller ones to as much of
// their view, or where they range over more to a 65,535th of their range. Texels
// that no player draws, of no face or no confidence, come back as background.
std::vector<std::byte> coded_maps(const CameraMaps& maps, const Intrinsics& lens);
// lens: the camera's; faces: how many the shell's surface has. Throws BadDataError, beginning with
// `name`, for anything that coded_maps() does not write and for what check_maps() refuses.
CameraMaps decoded_maps(std::span<const std::byte> bytes, const Intrinsics& lens, std::size_t faces,
                        const std::string& name);

// An image's channels R, G and B. Throws BadDataError, beginning with `name`, where one is missing.
std::vector<Eigen::Vector3f> colors_from_image(const ChannelImage& image, const std::string& name);

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
