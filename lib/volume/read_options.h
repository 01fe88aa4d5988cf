// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "volume/region.h"

namespace organbake {

struct VolumeReadOptions {
  std::string series = {};  // of a DICOM folder: UID or number; empty = the one that is a CT volume
  // Refuse what would have to be mended: uneven gaps, missing, repeated or damaged slices.
  bool strict = false;
  // Only the voxels round this box of the world are kept, and only the slices that they need are
  // read.
  std::optional<Region> region = {};
};

}  // namespace organbake
