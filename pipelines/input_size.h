// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

namespace organbake {

// How much an input holds, told by file sizes and headers alone: a thousand cases are looked at in
// seconds. All throw NoInputError.

// Voxels of a volume: of MetaImage and NRRD by their header, of gzip files by the size that they
// end with, of a DICOM folder or any other file by its bytes (two to a voxel; of compressed ones
// too few, by what the compression saves).
double voxels_in(const std::filesystem::path& volume);
// Frames of a picture (1), a folder (the pictures in it), or a video (by its bytes).
double frames_in(const std::filesystem::path& clip);
// Pixels of the pictures that lie beside a cameras.json, by their bytes.
double pixels_beside(const std::filesystem::path& cameras);
// Bytes of a file, or of all files in a folder.
double bytes_of(const std::filesystem::path& path);

}  // namespace organbake
