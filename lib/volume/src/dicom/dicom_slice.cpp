// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/dicom_slice.h"
#include "organbake/core/text.h"

#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMUtilities.h>
#include <vtkNew.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string_view>

#include "dicom/dicom_document.h"
#include "dicom/dicom_structure.h"
#include "dicom/inflated_dicom.h"
#include "dicom/vtk_error_log.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCtImageStorage = "1.2.840.10008.5.1.4.1.1.2";
constexpr int kMostFrames = 65535;
constexpr const char* kDirectoryClass = "1.2.840.10008.1.3.10";

std::string as_text(const vtkDICOMValue& read) { return trimmed(read.AsString(), " "); }

std::string text(vtkDICOMMetaData& data, vtkDICOMTag tag) { return as_text(data.Get(tag)); }

int integer(vtkDICOMMetaData& data, vtkDICOMTag tag, int otherwise) {
  return data.Has(tag) ? data.Get(tag).AsInt() : otherwise;
}

bool numbers(const vtkDICOMValue& value, std::size_t count, double* out) {
  if (value.GetNumberOfValues() != count) return false;
  for (std::size_t i = 0; i < count; ++i) out[i] = value.GetDouble(i);
  return std::all_of(out, out + count, [](double x) { return std::isfinite(x); });
}

// A frame's own value, else what all of its file share.
const vtkDICOMValue& of_frame(vtkDICOMMetaData& data, const DicomSlice& slice, vtkDICOMTag tag) {
  return data.Get(0, slice.frame, tag);
}

void read_geometry(vtkDICOMMetaData& data, DicomSlice& slice) {
  double position[3], orientation[6], spacing[2];
  if (!numbers(of_frame(data, slice, DC::ImagePositionPatient), 3, position) ||
      !numbers(of_frame(data, slice, DC::ImageOrientationPatient), 6, orientation) ||
      !numbers(of_frame(data, slice, DC::PixelSpacing), 2, spacing)) {
    return;
  }
  slice.position_mm = Eigen::Map<const Eigen::Vector3d>(position);
  slice.row_axis = Eigen::Map<const Eigen::Vector3d>(orientation);
  slice.column_axis = Eigen::Map<const Eigen::Vector3d>(orientation + 3);
  // DICOM gives the distance between rows first, which lies along the column axis.
  slice.pixel_mm = {spacing[1], spacing[0]};
  slice.has_geometry = true;
}

// The padding is written unsigned by some scanners whose pixels are signed, and the other way
// round: only its 16 bits count.
int as_stored(int value, bool is_signed) {
  const auto bits = static_cast<std::uint16_t>(value);
  return is_signed ? static_cast<std::int16_t>(bits) : bits;
}

DicomPixels pixels_from(vtkDICOMMetaData& data, vtkDICOMParser& parser) {
  DicomPixels pixels;
  pixels.transfer_syntax = text(data, DC::TransferSyntaxUID);
  pixels.big_endian = pixels.transfer_syntax == "1.2.840.10008.1.2.2";
  pixels.photometric = text(data, DC::PhotometricInterpretation);
  pixels.bits_allocated = integer(data, DC::BitsAllocated, 16);
  pixels.bits_stored = integer(data, DC::BitsStored, pixels.bits_allocated);
  pixels.is_signed = integer(data, DC::PixelRepresentation, 0) != 0;
  pixels.samples = integer(data, DC::SamplesPerPixel, 1);
  pixels.frames = integer(data, DC::NumberOfFrames, 1);
  pixels.present = parser.GetPixelDataFound() && parser.GetPixelDataVL() > 0;
  pixels.offset = static_cast<std::uint64_t>(std::max<vtkTypeInt64>(0, parser.GetFileOffset()));
  pixels.bytes = parser.GetPixelDataVL();
  if (data.Has(DC::PixelPaddingValue)) {
    const int value = data.Get(DC::PixelPaddingValue).AsInt();
    const int first = as_stored(value, pixels.is_signed);
    const int last = as_stored(integer(data, DC::PixelPaddingRangeLimit, value), pixels.is_signed);
    pixels.padding = {std::min(first, last), std::max(first, last)};
  }
  return pixels;
}

void read_what_tells_apart(vtkDICOMMetaData& data, DicomSlice& slice) {
  const std::pair<const char*, vtkDICOMTag> kTelling[] = {
      {"temporal position", DC::TemporalPositionIdentifier},
      {"temporal position", DC::TemporalPositionIndex},
      {"phase of the cycle, %", DC::NominalPercentageOfCardiacPhase},
      {"phase of the cycle, %", DC::NominalPercentageOfRespiratoryPhase},
      {"trigger time, ms", DC::TriggerTime},
      {"trigger time, ms", DC::NominalCardiacTriggerDelayTime},
      {"acquisition", DC::AcquisitionNumber},
      {"reconstruction kernel", DC::ConvolutionKernel},
      {"acquisition time", DC::AcquisitionTime},
      {"acquisition time", DC::AcquisitionDateTime},
      {"image type", DC::ImageType}};
  for (const auto& [what, tag] : kTelling) {
    const std::string value = as_text(of_frame(data, slice, tag));
    if (!value.empty()) slice.told_apart_by.emplace_back(what, value);
  }
}

DicomSlice slice_from(vtkDICOMMetaData& data, vtkDICOMParser& parser, const fs::path& file) {
  DicomSlice slice;
  slice.file = file;
  slice.series_uid = text(data, DC::SeriesInstanceUID);
  slice.series_number = text(data, DC::SeriesNumber);
  slice.frame_of_reference_uid = text(data, DC::FrameOfReferenceUID);
  slice.series_description = text(data, DC::SeriesDescription);
  slice.acquisition = text(data, DC::AcquisitionNumber);
  slice.modality = text(data, DC::Modality);
  slice.is_localizer = text(data, DC::ImageType).find("LOCALIZER") != std::string::npos;
  slice.rows = data.Get(DC::Rows).AsInt();
  slice.columns = data.Get(DC::Columns).AsInt();
  slice.pixels = pixels_from(data, parser);
  return slice;
}

// vtk-dicom's own test also knows files without the preamble, but wants 256 bytes.
bool is_dicom(const fs::path& file) {
  std::array<char, 132> first{};
  std::ifstream(file, std::ios::binary).read(first.data(), first.size());
  return std::string_view(first.data() + 128, 4) == "DICM" ||
         vtkDICOMUtilities::IsDICOMFile(file.c_str());
}

// A description is kept of every frame, before anybody looks for its pixels: an item of eight bytes
// at least, or several times that in a functional group.
bool can_hold(const fs::path& file, int frames) {
  constexpr std::uintmax_t kLeastFrame = 8;
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file, error);
  return frames <= 1 || (!error && static_cast<std::uintmax_t>(frames) <= bytes / kLeastFrame);
}

}  // namespace

void read_frame(vtkDICOMMetaData& data, int frame, DicomSlice& slice) {
  slice.frame = frame;
  const vtkDICOMValue& slope = of_frame(data, slice, DC::RescaleSlope);
  const vtkDICOMValue& intercept = of_frame(data, slice, DC::RescaleIntercept);
  if (slope.IsValid()) slice.slope = slope.AsDouble();
  if (intercept.IsValid()) slice.intercept = intercept.AsDouble();
  const std::string kind = as_text(of_frame(data, slice, DC::FrameType));
  slice.is_localizer |= kind.find("LOCALIZER") != std::string::npos;
  read_geometry(data, slice);
  read_what_tells_apart(data, slice);
}

ScannedFile scan_dicom_file(const fs::path& file) {
  ScannedFile scanned;
  scanned.file = file;
  scanned.is_dicom = is_dicom(file);
  if (!scanned.is_dicom) return scanned;
  vtkNew<vtkDICOMMetaData> data;
  vtkNew<vtkDICOMParser> parser;
  VtkErrorLog errors;
  errors.watch_object(parser);
  const ReadableDicom readable(file);
  if (const std::string flaw = flaw_of_dicom(readable.path()); !flaw.empty()) {
    scanned.damaged = true;
    scanned.reason = flaw;
    return scanned;
  }
  parser->SetMetaData(data);
  parser->SetFileName(readable.path().c_str());
  parser->Update();
  if (!errors.empty()) {
    scanned.damaged = true;
    scanned.reason = errors.first();
  } else if (data->Has(DC::Rows) && data->Has(DC::Columns)) {
    scanned.slice = slice_from(*data, *parser, file);
    read_frame(*data, 0, *scanned.slice);
    const int frames = scanned.slice->pixels.frames;
    if (!can_hold(readable.path(), frames)) {
      scanned.slice.reset();
      scanned.damaged = true;
      scanned.reason = "claims " + std::to_string(frames) + " frames, which it cannot hold";
      return scanned;
    }
    for (int frame = 1; frame < std::min(frames, kMostFrames); ++frame) {
      DicomSlice& later = scanned.later_frames.emplace_back(*scanned.slice);
      later.told_apart_by.clear();
      later.has_geometry = false;
      read_frame(*data, frame, later);
    }
  } else {
    // A report or a directory has no rows; a CT slice without them was cut off.
    const std::string kind = text(*data, DC::SOPClassUID);
    const bool other = !kind.empty() && kind != kCtImageStorage;
    const bool directory = text(*data, DC::MediaStorageSOPClassUID) == kDirectoryClass;
    scanned.damaged = !other && !directory;
    scanned.reason = scanned.damaged ? "ends before its image" : "holds no image";
  }
  return scanned;
}

}  // namespace organbake
