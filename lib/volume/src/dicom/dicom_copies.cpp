// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_copies.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/volume/dicom_folder.h"

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
    // Frames of one file are not looked for in it: they count as different.
    return std::to_string(slice.frame) + std::string(std::istreambuf_iterator<char>(file), {});
  }
  std::string bytes(slice.pixels.bytes, '\0');
  if (slice.pixels.frames > 1) {
    bytes.resize(slice.stored_bytes());
    file.seekg(static_cast<std::streamoff>(slice.pixels.offset) +
               static_cast<std::streamoff>(slice.stored_bytes()) * slice.frame);
  }
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

// One of several volumes of the same places.
struct SameVolume {
  std::string value;  // of what tells it apart: "3", "B30f"
  std::vector<DicomSlice> slices;
};
struct SameVolumes {
  std::string what;  // "temporal position"
  std::vector<SameVolume> volumes;
};

// Parted by the first property that explains why places are taken twice.
SameVolumes parted(const std::vector<DicomSlice>& sorted) {
  for (const auto& [what, ignored] : sorted.front().told_apart_by) {
    std::vector<std::string> values;
    for (const DicomSlice& slice : sorted) values.push_back(slice.told_by(what));
    SameVolumes found{what, {}};
    for (const SameValue& part : parted_by(values)) {
      SameVolume& volume = found.volumes.emplace_back(part.value);
      for (const std::size_t i : part.members) volume.slices.push_back(sorted[i]);
    }
    const bool explains =
        found.volumes.size() > 1 &&
        std::all_of(found.volumes.begin(), found.volumes.end(), [](const SameVolume& volume) {
          return volume.slices.size() > 1 && !has_copies(volume.slices);
        });
    if (explains) return found;
  }
  return {};
}

std::string listed(const SameVolumes& same) {
  std::string text;
  for (std::size_t i = 0; i < same.volumes.size(); ++i) {
    const SameVolume& volume = same.volumes[i];
    text += (i ? "; " : "") + std::to_string(i + 1) + ": " + same.what + " " + volume.value + ", " +
            std::to_string(volume.slices.size()) + " slices";
  }
  return text;
}

// The copies gone, if all that lies in one place is the same; else nothing.
std::vector<DicomSlice> same_slices_once(const std::vector<DicomSlice>& sorted,
                                         std::vector<fs::path>& copies, fs::path& differs) {
  std::vector<DicomSlice> kept;
  for (const DicomSlice& slice : sorted) {
    if (kept.empty() || !same_place(kept.back(), slice)) {
      kept.push_back(slice);
    } else if (same_pixels(kept.back(), slice)) {
      copies.push_back(slice.file);
    } else {
      differs = slice.file;
      return {};
    }
  }
  return kept;
}

SeriesPart chosen_part(const SameVolumes& same, const fs::path& folder,
                       const VolumeReadOptions& options) {
  SeriesPart part;
  part.time_points = static_cast<std::int64_t>(same.volumes.size());
  const auto by_size = [](const SameVolume& a, const SameVolume& b) {
    return a.slices.size() < b.slices.size();
  };
  const auto [least, most] = std::minmax_element(same.volumes.begin(), same.volumes.end(), by_size);
  const bool clear = same.what == "acquisition" && least->slices.size() < most->slices.size();
  if (options.time == 0 && clear) {
    part.slices = most->slices;
    part.warnings.push_back(
        "the series holds several acquisitions of the same places; acquisition " + most->value +
        " was taken, the one with most slices (" + listed(same) + "); --time chooses another");
    return part;
  }
  if (options.time > part.time_points) {
    throw UsageError(folder.string() + ": the series holds " + std::to_string(part.time_points) +
                     " volumes of the same places, no --time " + std::to_string(options.time) +
                     " (" + listed(same) + ")");
  }
  if (options.time == 0 && !options.any_time) {
    throw BadDataError(folder, "the series holds " + std::to_string(part.time_points) +
                                   " volumes of the same places (" + listed(same) +
                                   "); choose one with --time 1…" +
                                   std::to_string(part.time_points));
  }
  const auto index = static_cast<std::size_t>(std::max(options.time, 1) - 1);
  part.slices = same.volumes[index].slices;
  part.warnings.push_back("the series holds " + std::to_string(part.time_points) +
                          " volumes of the same places; number " + std::to_string(index + 1) +
                          " was taken (" + listed(same) + ")");
  return part;
}

}  // namespace

std::vector<SameValue> parted_by(const std::vector<std::string>& values) {
  const auto number = [](const std::string& text) {
    double value = 0;
    return read_number(text, value) == text.size() && !text.empty() ? value : HUGE_VAL;
  };
  std::map<std::pair<double, std::string>, std::vector<std::size_t>> parts;
  for (std::size_t i = 0; i < values.size(); ++i)
    parts[{number(values[i]), values[i]}].push_back(i);
  std::vector<SameValue> all;
  for (auto& [key, members] : parts) all.push_back({key.second, std::move(members)});
  return all;
}

SeriesPart without_copies(std::vector<DicomSlice> sorted, const fs::path& folder,
                          const VolumeReadOptions& options) {
  if (!has_copies(sorted)) {
    if (options.time > 1 && !options.lasting) {
      throw UsageError(folder.string() + ": the series holds one volume, no --time " +
                       std::to_string(options.time));
    }
    return {std::move(sorted), 1, {}};
  }
  if (same_place(sorted.front(), sorted.back())) {
    throw BadDataError(folder, "all " + std::to_string(sorted.size()) +
                                   " slices lie in one place; they form no volume");
  }
  SeriesPart part;
  std::vector<fs::path> copies;
  fs::path differs;
  part.slices = same_slices_once(sorted, copies, differs);
  if (differs.empty()) {
    part.warnings.push_back(std::to_string(copies.size()) + " copies of slices were passed over (" +
                            named_files(copies) + ")");
    return part;
  }
  const SameVolumes same = parted(sorted);
  if (same.volumes.empty()) {
    throw BadDataError(differs,
                       "lies in the same place as another slice and differs from it: the "
                       "series holds more than one volume, and nothing in the headers "
                       "tells them apart; give a folder of one");
  }
  return chosen_part(same, folder, options);
}

}  // namespace organbake
