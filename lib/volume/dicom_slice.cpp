// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/dicom_slice.h"

#include <tbb/parallel_for.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMUtilities.h>
#include <vtkNew.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>

#include "core/error.h"
#include "formats/vtk_error_log.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCtImageStorage = "1.2.840.10008.5.1.4.1.1.2";
constexpr const char* kDirectoryStorage = "1.2.840.10008.1.3.10";

std::string text(vtkDICOMMetaData& data, vtkDICOMTag tag) {
  std::string value = data.Get(tag).AsString();
  value.erase(value.find_last_not_of(' ') + 1);
  return value;
}

bool numbers(vtkDICOMMetaData& data, vtkDICOMTag tag, std::size_t count, double* out) {
  const vtkDICOMValue& value = data.Get(tag);
  if (value.GetNumberOfValues() != count) return false;
  for (std::size_t i = 0; i < count; ++i) out[i] = value.GetDouble(i);
  return std::all_of(out, out + count, [](double x) { return std::isfinite(x); });
}

void read_geometry(vtkDICOMMetaData& data, DicomSlice& slice) {
  double position[3], orientation[6], spacing[2];
  if (!numbers(data, DC::ImagePositionPatient, 3, position) ||
      !numbers(data, DC::ImageOrientationPatient, 6, orientation) ||
      !numbers(data, DC::PixelSpacing, 2, spacing)) {
    return;
  }
  slice.position_mm = Eigen::Map<const Eigen::Vector3d>(position);
  slice.row_axis = Eigen::Map<const Eigen::Vector3d>(orientation);
  slice.column_axis = Eigen::Map<const Eigen::Vector3d>(orientation + 3);
  // DICOM gives the distance between rows first, which lies along the column axis.
  slice.pixel_mm = {spacing[1], spacing[0]};
  slice.has_geometry = true;
}

DicomSlice slice_from(vtkDICOMMetaData& data, const fs::path& file) {
  DicomSlice slice;
  slice.file = file;
  slice.series_uid = text(data, DC::SeriesInstanceUID);
  slice.series_number = text(data, DC::SeriesNumber);
  slice.modality = text(data, DC::Modality);
  slice.transfer_syntax = text(data, DC::TransferSyntaxUID);
  slice.photometric = text(data, DC::PhotometricInterpretation);
  slice.rows = data.Get(DC::Rows).AsInt();
  slice.columns = data.Get(DC::Columns).AsInt();
  if (data.Has(DC::NumberOfFrames)) slice.frames = data.Get(DC::NumberOfFrames).AsInt();
  if (data.Has(DC::RescaleSlope)) slice.slope = data.Get(DC::RescaleSlope).AsDouble();
  if (data.Has(DC::RescaleIntercept)) slice.intercept = data.Get(DC::RescaleIntercept).AsDouble();
  read_geometry(data, slice);
  return slice;
}

// One file of a folder: an image's header, what is wrong with it, or neither (not DICOM, no image).
struct ScannedFile {
  std::optional<DicomSlice> slice;
  std::string error;
};

// vtk-dicom's own test also knows files without the preamble, but wants 256 bytes.
bool is_dicom(const fs::path& file) {
  std::array<char, 132> first{};
  std::ifstream(file, std::ios::binary).read(first.data(), first.size());
  return std::string_view(first.data() + 128, 4) == "DICM" ||
         vtkDICOMUtilities::IsDICOMFile(file.c_str());
}

ScannedFile scan_file(const fs::path& file) {
  if (!is_dicom(file)) return {};
  vtkNew<vtkDICOMMetaData> data;
  vtkNew<vtkDICOMParser> parser;
  VtkErrorLog errors;
  errors.watch_object(parser);
  parser->SetMetaData(data);
  parser->SetFileName(file.c_str());
  parser->Update();
  if (!errors.empty()) return {std::nullopt, errors.first()};
  if (!data->Has(DC::Rows) || !data->Has(DC::Columns)) {
    // A report or a directory has no rows; a CT slice without them was cut off.
    const std::string kind = text(*data, DC::SOPClassUID);
    const bool other = !kind.empty() && kind != kCtImageStorage;
    const bool directory = text(*data, DC::MediaStorageSOPClassUID) == kDirectoryStorage;
    return {std::nullopt, other || directory ? "" : "ends before its image"};
  }
  return {slice_from(*data, file), {}};
}

}  // namespace

DicomFolder scan_dicom_folder(const fs::path& folder) {
  std::vector<fs::path> files;
  bool has_subfolders = false;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
    has_subfolders |= entry.is_directory();
  }
  const std::string hint = has_subfolders ? "; give the subfolder that holds the CT series" : "";
  if (files.empty()) throw NoInputError(folder, "holds no files" + hint);
  std::sort(files.begin(), files.end());
  std::vector<ScannedFile> scanned(files.size());
  tbb::parallel_for(std::size_t{0}, files.size(),
                    [&](std::size_t i) { scanned[i] = scan_file(files[i]); });
  DicomFolder found;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (scanned[i].slice) found.slices.push_back(std::move(*scanned[i].slice));
    if (scanned[i].error.empty()) continue;
    if (found.unreadable++ == 0) {
      found.first_error = files[i].filename().string() + ": " + scanned[i].error;
    }
  }
  if (found.slices.empty() && found.unreadable > 0) {
    throw BadDataError(folder, "none of its DICOM files can be read; " + found.first_error);
  }
  if (found.slices.empty()) {
    throw NoInputError(
        folder, "holds no DICOM image among its " + std::to_string(files.size()) + " files" + hint);
  }
  return found;
}

}  // namespace organbake
