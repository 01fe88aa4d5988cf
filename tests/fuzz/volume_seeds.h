// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fuzz/readers.h"

namespace organbake {

// Small volumes as the programs of the field write them: every kind of number, order of bytes,
// packing and placement that a format has.
Seeds nifti_seeds();
Seeds zipped_nifti_seeds();
Seeds nrrd_seeds();
Seeds layered_mask_seeds();  // of NRRD
Seeds metaimage_seeds();
Seeds vti_seeds();
Seeds detached_volume_seeds();

// What these formats can hold and is not read: complex numbers, several values a voxel, LZ4.
Seeds refused_niftis();
Seeds refused_zipped_niftis();
Seeds refused_vtis();

}  // namespace organbake
