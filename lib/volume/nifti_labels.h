// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "volume/byte_stream.h"
#include "volume/volume.h"

namespace organbake {

// The names of a mask's labels from the extensions behind a NIfTI header, where `left` bytes lie
// before the voxels; `left` falls by what was read. TotalSegmentator and Connectome Workbench write
// a label table as XML. None when there is no such table.
std::vector<LabelName> read_nifti_labels(ByteStream& stream, std::uint64_t& left);

}  // namespace organbake
