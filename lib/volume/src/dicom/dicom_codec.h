// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "dicom/dicom_codestream.h"
#include "organbake/volume/dicom_slice.h"

namespace organbake {

// Decompresses one frame with GDCM's codecs: rows × columns values of bits_allocated bits in the
// machine's byte order. GDCM's file parser, which ends the program on damaged headers, is not
// involved. Throws BadDataError naming the file.
std::vector<std::byte> decompress(const DicomSlice& slice, DicomCoding coding);

}  // namespace organbake
