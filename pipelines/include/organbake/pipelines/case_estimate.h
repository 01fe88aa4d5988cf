// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

// What a bake is thought to need, before it starts. Meant to be rather too much than too little.
struct CaseEstimate {
  double cpu_seconds = 0;  // of one core
  double memory_mb = 0;
  std::string flaw;  // why nothing can be told: the bake will fail for the same reason
};

// By the sizes of the inputs and the options that cost time, with constants that were measured
// (case_estimate.cpp). Reads headers, not contents; never throws for what is wrong with a case.
CaseEstimate estimate_case(const std::filesystem::path& recipe,
                           const std::vector<std::string>& settings);

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
