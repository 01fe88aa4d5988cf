// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/dicom_series.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "organbake/core/error.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Slices that can form one volume agree in these, directions to a thousandth.
using GridKey = std::tuple<int, int, std::array<long, 8>>;

GridKey key_of(const DicomSlice& slice) {
  std::array<long, 8> rounded;
  for (int i = 0; i < 3; ++i) {
    rounded[i] = std::lround(slice.row_axis[i] * 1e3);
    rounded[3 + i] = std::lround(slice.column_axis[i] * 1e3);
  }
  for (int i = 0; i < 2; ++i) rounded[6 + i] = std::lround(slice.pixel_mm[i] * 1e4);
  return {slice.columns, slice.rows, rounded};
}

// Why an image cannot be a slice of a CT volume; empty when it can.
std::string against(const DicomSlice& slice) {
  if (slice.modality != "CT") {
    return "of modality \"" + slice.modality + "\", whose values are not Hounsfield units";
  }
  if (slice.is_localizer) return "a localizer";
  if (!slice.pixels.present) return "without pixel data";
  if (!slice.has_geometry) {
    return "without ImagePositionPatient, ImageOrientationPatient or PixelSpacing: the place in "
           "the patient is unknown";
  }
  return {};
}

using Strays = std::map<std::string, std::vector<fs::path>>;  // by reason

std::string images_text(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " image" : " images");
}

// The largest group of like slices; the others are strays.
std::vector<DicomSlice> largest_group(std::vector<DicomSlice> slices, Strays& strays) {
  std::map<GridKey, std::vector<DicomSlice>> groups;
  for (DicomSlice& slice : slices) groups[key_of(slice)].push_back(std::move(slice));
  auto most = groups.begin();
  for (auto it = groups.begin(); it != groups.end(); ++it) {
    if (it->second.size() > most->second.size()) most = it;
  }
  for (auto it = groups.begin(); it != groups.end(); ++it) {
    if (it == most) continue;
    for (const DicomSlice& slice : it->second) {
      strays["of another size, direction or pixel spacing"].push_back(slice.file);
    }
  }
  return most == groups.end() ? std::vector<DicomSlice>{} : std::move(most->second);
}

void sort_out(std::vector<DicomSlice> images, DicomSeries& series) {
  series.images = images.size();
  Strays strays;
  std::vector<DicomSlice> usable;
  for (DicomSlice& image : images) {
    const std::string reason = against(image);
    if (reason.empty()) {
      usable.push_back(std::move(image));
    } else {
      strays[reason].push_back(image.file);
    }
  }
  series.slices = largest_group(std::move(usable), strays);
  for (const auto& [reason, files] : strays) {
    series.passed_over.push_back(images_text(files.size()) + " " + reason + " (" +
                                 named_files(files) + ")");
  }
  if (series.slices.empty()) {
    series.unfit = series.passed_over.front();
  } else if (series.slices.size() == 1) {
    const DicomSlice& only = series.slices.front();
    series.unfit = only.file.filename().string() +
                   " is the only CT slice of its series; a volume needs at least two";
  }
}

// Series numbers are numbers, but DICOM holds them as text.
bool comes_before(const DicomSeries& a, const DicomSeries& b) {
  if (a.number.size() != b.number.size()) return a.number.size() < b.number.size();
  return std::tie(a.number, a.uid) < std::tie(b.number, b.uid);
}

std::string all_lines(const std::vector<DicomSeries>& all) {
  std::string text;
  for (const DicomSeries& series : all) text += (text.empty() ? "" : "; ") + series.line();
  return text;
}

const DicomSeries& wanted_series(const std::vector<DicomSeries>& all, const std::string& wanted,
                                 const fs::path& folder) {
  const DicomSeries* found = nullptr;
  for (const DicomSeries& series : all) {
    if (series.uid == wanted) return series;
    if (series.number != wanted) continue;
    if (found) {
      throw BadDataError(
          folder, "several series have the number " + wanted + "; give the UID: " + all_lines(all));
    }
    found = &series;
  }
  if (!found) {
    throw BadDataError(folder, "holds no series \"" + wanted + "\" but " + all_lines(all));
  }
  return *found;
}

const DicomSeries& best_series(const std::vector<DicomSeries>& all, const fs::path& folder,
                               std::vector<std::string>& warnings) {
  const DicomSeries* best = nullptr;
  std::size_t fit = 0;
  for (const DicomSeries& series : all) {
    if (!series.fit()) continue;
    ++fit;
    if (!best || series.slices.size() > best->slices.size()) best = &series;
  }
  if (!best) {
    const std::string why = all.size() == 1 ? all.front().unfit : all_lines(all);
    throw BadDataError(folder, "holds no CT volume: " + why);
  }
  if (all.size() == 1) return *best;
  std::string others;
  for (const DicomSeries& series : all) {
    if (&series != best) others += (others.empty() ? "" : "; ") + series.line();
  }
  warnings.push_back("of " + std::to_string(all.size()) + " series, " + best->name() +
                     " was taken, " +
                     (fit == 1 ? "the only CT volume" : "the CT volume with most slices") + " (" +
                     std::to_string(best->slices.size()) + "); not taken: " + others +
                     "; --series chooses another");
  return *best;
}

void tell_of_others(const DicomFolder& folder, std::vector<std::string>& warnings) {
  std::vector<fs::path> damaged, no_images;
  std::string first_error;
  for (const ScannedFile& other : folder.others) {
    (other.damaged ? damaged : no_images).push_back(other.file);
    if (other.damaged && first_error.empty()) first_error = other.reason;
  }
  if (!damaged.empty()) {
    warnings.push_back(std::to_string(damaged.size()) + " DICOM files could not be read (" +
                       named_files(damaged) + "): " + first_error);
  }
  if (!no_images.empty()) {
    warnings.push_back("passed over: " + std::to_string(no_images.size()) +
                       " DICOM files that hold no image (" + named_files(no_images) + ")");
  }
}

}  // namespace

std::string DicomSeries::name() const {
  return "series " + (number.empty() ? "without number" : number) +
         (description.empty() ? "" : " \"" + description + "\"");
}

std::string DicomSeries::line() const {
  std::string text = name() + ", " + images_text(images) + " of modality " + modality;
  if (!slices.empty()) {
    text += ", " + std::to_string(slices.front().columns) + "×" +
            std::to_string(slices.front().rows) + "×" + std::to_string(slices.size());
  }
  text += ", UID " + uid;
  return fit() ? text : text + ", no CT volume: " + unfit;
}

std::vector<DicomSeries> list_series(const DicomFolder& folder) {
  std::map<std::string, std::vector<DicomSlice>> by_uid;
  for (const DicomSlice& slice : folder.slices) by_uid[slice.series_uid].push_back(slice);
  std::vector<DicomSeries> all;
  for (auto& [uid, images] : by_uid) {
    const DicomSlice& first = images.front();
    DicomSeries series;
    series.uid = uid;
    series.number = first.series_number;
    series.description = first.series_description;
    series.modality = first.modality;
    sort_out(std::move(images), series);
    all.push_back(std::move(series));
  }
  std::sort(all.begin(), all.end(), comes_before);
  return all;
}

DicomSeries choose_series(const DicomFolder& folder, const std::string& wanted,
                          std::vector<std::string>& warnings) {
  const std::vector<DicomSeries> all = list_series(folder);
  const DicomSeries& chosen = wanted.empty() ? best_series(all, folder.path, warnings)
                                             : wanted_series(all, wanted, folder.path);
  if (!chosen.fit()) {
    throw BadDataError(folder.path, chosen.name() + " gives no CT volume: " + chosen.unfit);
  }
  for (const std::string& stray : chosen.passed_over) warnings.push_back("passed over: " + stray);
  tell_of_others(folder, warnings);
  return chosen;
}

}  // namespace organbake
