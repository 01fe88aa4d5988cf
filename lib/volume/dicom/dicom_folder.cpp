// SPDX-License-Identifier: GPL-3.0-or-later
// What a folder, a disc's DICOMDIR (PS3.10, PS3.3 F) or one file holds of images, sorted into
// series, and the one series among them that is a CT volume.
#include <vtkDICOMItem.h>
#include <vtkDICOMValue.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "dicom/dicom.h"
#include "dicom/dicom_document.h"
#include "files/volume_files.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kDirectoryStorage = "1.2.840.10008.1.3.10";

// As a copy of the disc may have it: in any case, with a version behind.
bool same_name(const std::string& listed, std::string found) {
  found = found.substr(0, found.find(';'));
  return lower_case(listed) == lower_case(found);
}

fs::path entry_of(const fs::path& folder, const std::string& name) {
  std::error_code error;
  if (fs::exists(folder / name, error)) return folder / name;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (same_name(name, entry.path().filename().string())) return entry.path();
  return {};
}

// Whether a file is the directory of a DICOM disc (DICOMDIR), by its content.
bool is_dicom_directory(const fs::path& file) {
  // The meta group, of a few hundred bytes, names what the file is.
  const std::string bytes = beginning_of(file, 512);
  if (!starts_dicom(bytes)) return false;
  const std::size_t at = bytes.find(kDirectoryStorage);
  if (at == bytes.npos) return false;
  // UIDs of images begin alike: 1.2.840.10008.1.3.10 must end there.
  const char next =
      at + kDirectoryStorage.size() < bytes.size() ? bytes[at + kDirectoryStorage.size()] : '\0';
  return next != '.' && !(next >= '0' && next <= '9');
}

// The images that a DICOMDIR lists, relative to its folder, in its order. Throws BadDataError.
std::vector<fs::path> images_of_directory(const fs::path& file) {
  const DicomDocument document(file);
  document.check();
  std::vector<fs::path> images;
  const vtkDICOMValue& records = document.data().Get(DC::DirectoryRecordSequence);
  for (std::size_t i = 0; i < records.GetNumberOfValues(); ++i) {
    const vtkDICOMValue& parts = records.GetItem(i).Get(DC::ReferencedFileID);
    fs::path image;
    for (std::size_t part = 0; part < parts.GetNumberOfValues(); ++part) {
      const std::string name = trimmed(parts.GetString(part));
      // A directory lists what lies below it, and nothing else.
      if (name == ".." || name.find('/') != std::string::npos)
        throw BadDataError(file, "lists \"" + name + "\", which is no name of a file");
      image /= name;
    }
    if (!image.empty()) images.push_back(image);
  }
  if (images.empty()) throw BadDataError(file, "is a DICOM directory that lists no image");
  return images;
}

// A listed file as it is called on this disk: names are upper case by the standard, and often lower
// case or with ";1" behind them once they are copied. Empty when there is no such file.
fs::path as_on_disc(const fs::path& root, const fs::path& listed) {
  fs::path found = root.empty() ? fs::path(".") : root;
  for (const fs::path& part : listed) {
    found = entry_of(found, part.string());
    if (found.empty()) return {};
  }
  return found;
}

}  // namespace

std::string named_files(const std::vector<fs::path>& files) {
  constexpr std::size_t kNamed = 4;
  const std::span named = std::span(files).first(std::min(files.size(), kNamed));
  const std::string names =
      joined(named, ", ", [](const fs::path& file) { return file.filename().string(); });
  if (files.size() <= kNamed) return names;
  return names + " and " + std::to_string(files.size() - kNamed) + " more";
}

namespace {

DicomFolder scan_files(const fs::path& folder, std::vector<fs::path> files,
                       const std::string& hint) {
  if (files.empty()) throw NoInputError(folder, "holds no files" + hint);
  std::sort(files.begin(), files.end());
  std::vector<ScannedFile> scanned(files.size());
  parallel_for(std::size_t{0}, files.size(),
               [&](std::size_t i) { scanned[i] = scan_dicom_file(files[i]); });
  DicomFolder found;
  found.path = folder;
  for (ScannedFile& file : scanned) {
    if (file.slice) {
      found.slices.push_back(std::move(*file.slice));
      std::move(file.later_frames.begin(), file.later_frames.end(),
                std::back_inserter(found.slices));
    } else if (file.is_dicom) {
      found.others.push_back(std::move(file));
    }
  }
  if (!found.slices.empty()) return found;
  for (const ScannedFile& file : found.others) {
    if (!file.damaged) continue;
    throw BadDataError(folder, "none of its DICOM files can be read, copy the series again; " +
                                   file.file.filename().string() + ": " + file.reason);
  }
  std::vector<fs::path> no_images;
  for (const ScannedFile& file : found.others) no_images.push_back(file.file);
  const std::string which = no_images.empty() ? "" : " (" + named_files(no_images) + ": no image)";
  throw NoInputError(folder, "holds no DICOM image among its " + std::to_string(files.size()) +
                                 " files" + which + hint);
}

}  // namespace

DicomFolder scan_dicom_folder(const fs::path& folder) {
  std::vector<fs::path> files;
  bool has_subfolders = false;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
    has_subfolders |= entry.is_directory();
  }
  // A disc keeps its images in subfolders, and a directory of them at its root.
  for (const fs::path& file : files)
    if (is_dicom_directory(file)) return scan_dicom_file_or_directory(file);
  return scan_files(folder, std::move(files),
                    has_subfolders ? "; give the subfolder that holds the CT series" : "");
}

DicomFolder scan_dicom_file_or_directory(const fs::path& file) {
  if (is_dicom_directory(file)) {
    const fs::path root = file.parent_path();
    std::vector<fs::path> files, missing;
    for (const fs::path& image : images_of_directory(file)) {
      const fs::path found = as_on_disc(root, image);
      (found.empty() ? missing : files).push_back(found.empty() ? root / image : found);
    }
    if (files.empty())
      throw NoInputError(file, "lists " + std::to_string(missing.size()) +
                                   " images, of which none is there; copy the whole disc");
    DicomFolder folder = scan_files(file, std::move(files), "");
    for (const fs::path& path : missing) {
      folder.others.push_back({path, {}, {}, true, true, "is missing"});
    }
    return folder;
  }
  const ScannedFile scanned = scan_dicom_file(file);
  if (scanned.damaged || !scanned.slice)
    throw BadDataError(file, scanned.damaged ? scanned.reason : "is a DICOM file without an image");
  if (!scanned.later_frames.empty()) return scan_files(file, {file}, "");
  // One slice stands for its series, which lies beside it.
  DicomFolder folder = scan_dicom_folder(file.parent_path().empty() ? "." : file.parent_path());
  std::erase_if(folder.slices, [&](const DicomSlice& slice) {
    return slice.series_uid != scanned.slice->series_uid;
  });
  return folder;
}

namespace {

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
  if (slice.modality != "CT")
    return "of modality \"" + slice.modality + "\", whose values are not Hounsfield units";
  if (slice.is_localizer) return "a localizer";
  if (!slice.pixels.present) return "without pixel data";
  if (!slice.has_geometry)
    return "without ImagePositionPatient, ImageOrientationPatient or PixelSpacing: the place in "
           "the patient is unknown";
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
  if (groups.empty()) return {};
  const auto most =
      std::ranges::max_element(groups, {}, [](const auto& group) { return group.second.size(); });
  std::vector<DicomSlice> largest = std::move(most->second);
  groups.erase(most);
  for (const auto& [key, others] : groups)
    for (const DicomSlice& slice : others)
      strays["of another size, direction or pixel spacing"].push_back(slice.file);
  return largest;
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
  for (const auto& [reason, files] : strays)
    series.passed_over.push_back(images_text(files.size()) + " " + reason + " (" +
                                 named_files(files) + ")");
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
  return joined(all, "; ", [](const DicomSeries& series) { return series.line(); });
}

const DicomSeries& wanted_series(const std::vector<DicomSeries>& all, const std::string& wanted,
                                 const fs::path& folder) {
  const DicomSeries* found = nullptr;
  for (const DicomSeries& series : all) {
    if (series.uid == wanted) return series;
    if (series.number != wanted) continue;
    if (found)
      throw BadDataError(
          folder, "several series have the number " + wanted + "; give the UID: " + all_lines(all));
    found = &series;
  }
  if (!found)
    throw BadDataError(folder, "holds no series \"" + wanted + "\" but " + all_lines(all));
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
  for (const DicomSeries& series : all)
    if (&series != best) others += (others.empty() ? "" : "; ") + series.line();
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
  if (!damaged.empty())
    warnings.push_back(std::to_string(damaged.size()) + " DICOM files could not be read (" +
                       named_files(damaged) + "): " + first_error);
  if (!no_images.empty())
    warnings.push_back("passed over: " + std::to_string(no_images.size()) +
                       " DICOM files that hold no image (" + named_files(no_images) + ")");
}

}  // namespace

std::string DicomSeries::name() const {
  return "series " + (number.empty() ? "without number" : number) +
         (description.empty() ? "" : " \"" + description + "\"");
}

std::string DicomSeries::line() const {
  std::string text = name() + ", " + images_text(images) + " of modality " + modality;
  if (!slices.empty())
    text += ", " + std::to_string(slices.front().columns) + "×" +
            std::to_string(slices.front().rows) + "×" + std::to_string(slices.size());
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
  if (!chosen.fit())
    throw BadDataError(folder.path, chosen.name() + " gives no CT volume: " + chosen.unfit);
  for (const std::string& stray : chosen.passed_over) warnings.push_back("passed over: " + stray);
  tell_of_others(folder, warnings);
  return chosen;
}

DicomContents contents_of(const fs::path& folder) {
  const DicomFolder found = scan_dicom_folder(folder);
  DicomContents contents;
  for (const DicomSeries& one : list_series(found)) contents.series.push_back(one.line());
  for (const ScannedFile& other : found.others)
    contents.other_files.push_back(other.file.filename().string() + ": " + other.reason);
  return contents;
}

}  // namespace organbake
