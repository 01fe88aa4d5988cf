// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// VTK XML image data (.vti) through VTK's reader: the active (or only) point array of one
// component. VTK has no word for the patient's axes; its world is taken as LPS millimetres.
Volume read_vti(const std::filesystem::path& path, const VolumeReadOptions& options = {});

}  // namespace organbake
