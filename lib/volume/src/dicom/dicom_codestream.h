// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "organbake/volume/dicom_slice.h"

namespace organbake {

enum class DicomCoding { native, lossy_jpeg, lossless_jpeg, jpeg_ls, jpeg_2000, rle, unknown };

// What a transfer syntax stands for. No syntax at all is a file without a meta group, which is
// native (uncompressed) by PS3.10.
DicomCoding coding_of(const std::string& transfer_syntax);

// Reads the fragments of compressed pixel data (PS3.5, A.4) and joins them: one frame's codestream.
// Then holds what the codestream says about itself against the header: the decoders take a lie for
// a reason to end the program, so they must not see one. Throws BadDataError naming the file.
std::vector<std::byte> read_codestream(const DicomSlice& slice, DicomCoding coding);

}  // namespace organbake
