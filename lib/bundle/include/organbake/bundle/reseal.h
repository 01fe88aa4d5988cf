// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"

namespace organbake {

struct ResealedBundle {
  Manifest manifest;                 // of the files as they lie there now
  std::vector<std::string> changed;  // against the manifest that lies there; none: nothing to write
};

// Takes over images that were edited by hand: cam_…/color.exr, depth.exr, micro.exr, detail.exr and
// base.exr, of the same size and with the channels that they need. Every check of a bundle is made
// on what lies there now, and where depth or microstructure changed, that both still tell the same
// place: farther apart than a texel is wide, pushed skin would jump. Reads alone; the caller writes
// manifest_to_json(manifest). Throws NoInputError, or BadDataError that names the file: one that is
// missing, not listed, damaged, of another size, or no such image (geometry, cameras and mechanics
// are what the maps were baked for).
ResealedBundle reseal(const std::filesystem::path& folder);

}  // namespace organbake
