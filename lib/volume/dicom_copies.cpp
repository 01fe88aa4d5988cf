// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/dicom_copies.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>

#include "core/error.h"
#include "volume/dicom_folder.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

bool same_place(const DicomSlice& a, const DicomSlice& b) {
  return std::abs((a.position_mm - b.position_mm).dot(a.normal().normalized())) < kSamePlace_mm;
}

bool has_copies(const std::vector<DicomSlice>& sorted) {
  return std::adjacent_find(sorted.begin(), sorted.end(), same_place) != sorted.end();
}

std::string stored_pixels(const DicomSlice& slice) {
  std::ifstream file(slice.file, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(slice.pixels.offset));
  if (slice.pixels.bytes == DicomPixels::kEncapsulated) {
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::string bytes(slice.pixels.bytes, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

bool same_pixels(const DicomSlice& a, const DicomSlice& b) {
  constexpr double kSameGrid_mm = 1e-3;
  return a.slope == b.slope && a.intercept == b.intercept &&
         a.pixels.bits_stored == b.pixels.bits_stored &&
         a.pixels.transfer_syntax == b.pixels.transfer_syntax &&
         (a.position_mm - b.position_mm).norm() < kSameGrid_mm &&
         stored_pixels(a) == stored_pixels(b);
}

// The slices of the acquisition that has most of them, provided that acquisitions explain why
// places are taken twice.
std::vector<DicomSlice> largest_acquisition(const std::vector<DicomSlice>& sorted) {
  std::map<std::string, std::vector<DicomSlice>> by_acquisition;
  for (const DicomSlice& slice : sorted) by_acquisition[slice.acquisition].push_back(slice);
  std::vector<DicomSlice> best;
  for (const auto& [number, slices] : by_acquisition) {
    if (has_copies(slices)) return {};
    if (slices.size() > best.size()) best = slices;
  }
  return best;
}

}  // namespace

std::vector<DicomSlice> without_copies(std::vector<DicomSlice> sorted, const fs::path& folder,
                                       std::vector<std::string>& warnings) {
  if (!has_copies(sorted)) return sorted;
  if (same_place(sorted.front(), sorted.back())) {
    throw BadDataError(folder, "all " + std::to_string(sorted.size()) +
                                   " slices lie in one place; they form no volume");
  }
  std::vector<DicomSlice> kept;
  std::vector<fs::path> copies;
  const DicomSlice* other = nullptr;
  for (DicomSlice& slice : sorted) {
    if (kept.empty() || !same_place(kept.back(), slice)) {
      kept.push_back(slice);
    } else if (same_pixels(kept.back(), slice)) {
      copies.push_back(slice.file);
    } else {
      other = &slice;
      break;
    }
  }
  if (!other) {
    warnings.push_back(std::to_string(copies.size()) + " copies of slices were passed over (" +
                       named_files(copies) + ")");
    return kept;
  }
  std::vector<DicomSlice> acquisition = largest_acquisition(sorted);
  if (acquisition.size() < 2) {
    throw BadDataError(other->file, "lies in the same place as " +
                                        kept.back().file.filename().string() +
                                        " and differs from it: the series holds more than one "
                                        "volume (time points or reconstructions)");
  }
  warnings.push_back("the series holds several acquisitions of the same places; acquisition " +
                     acquisition.front().acquisition + " was taken, the one with most slices (" +
                     std::to_string(acquisition.size()) + " of " + std::to_string(sorted.size()) +
                     ")");
  return acquisition;
}

}  // namespace organbake
