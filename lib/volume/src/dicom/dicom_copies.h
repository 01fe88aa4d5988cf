// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "organbake/volume/dicom_slice.h"
#include "organbake/volume/read_options.h"

namespace organbake {

// Two positions nearer than this are one place.
inline constexpr double kSamePlace_mm = 1e-3;

// Which of many things share a value, values in order: numbers as numbers, 2 before 10.
struct SameValue {
  std::string value;
  std::vector<std::size_t> members;
};
std::vector<SameValue> parted_by(const std::vector<std::string>& values);

// What is left of a series.
struct SeriesPart {
  std::vector<DicomSlice> slices;
  std::int64_t time_points = 1;  // volumes of the same places that there were
  std::vector<std::string> warnings;
};

// Leaves one slice for every place along the normal, by which the slices are sorted: copies (the
// same stored pixels) go. Where the same places were taken several times, at several times of the
// heart's or the breath's cycle, in several acquisitions or reconstructions, options.time says
// which volume is taken; without it, of acquisitions of different size the one with most slices is,
// with a warning, and otherwise the volumes are listed in an error. Throws BadDataError also when
// all slices lie in one place, or when two that differ lie in the same place and nothing tells them
// apart.
SeriesPart without_copies(std::vector<DicomSlice> sorted, const std::filesystem::path& folder,
                          const VolumeReadOptions& options);

}  // namespace organbake
