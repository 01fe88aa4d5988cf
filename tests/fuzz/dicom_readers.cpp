// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_codec.h"
#include "fuzz/dicom_seeds.h"
#include "fuzz/readers.h"
#include "fuzz/volumes_as_asked.h"
#include "organbake/volume/dicom_folder.h"
#include "organbake/volume/dicom_series.h"
#include "organbake/volume/read_volume.h"

namespace organbake {
namespace {

using namespace std::string_view_literals;

void read_dicom_image(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_all_and_a_part(folder.file("image.dcm", bytes));
}

void read_dicom_mask(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_mask_and_labels(folder.file("mask.dcm", bytes));
}

const std::vector<std::string> kSeries = {"1", "2", "3", "4", "DICOMDIR", "note.txt", "5", "6"};

// What is taken of a folder by itself, then the last series by its number.
void read_series(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path at = folder.parts(kSeries, bytes);
  read_all_and_a_part(at);
  const std::vector<DicomSeries> all = list_series(scan_dicom_folder(at));
  if (all.size() > 1) read_volume(at, {.series = all.back().number, .any_time = true});
}

void read_zipped_series(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_all_and_a_part(folder.file("series.zip", bytes));
}

void read_codestream_of_frame(std::span<const std::byte> bytes, const InputFolder& folder) {
  if (bytes.empty()) return;
  const std::string syntax = codestream_syntax(std::to_integer<unsigned>(bytes[0]));
  const std::string file = dicom_around(syntax, text_of(bytes.subspan(1)), 0);
  const ScannedFile scanned = scan_dicom_file(folder.file("image.dcm", bytes_of(file)));
  if (!scanned.slice) throw BadDataError(scanned.file, scanned.reason);
  decompress(*scanned.slice, coding_of(syntax));
}

const Words kDicom = {"DICM",
                      "OB",
                      "OW",
                      "SQ",
                      "UN",
                      "UI",
                      "US",
                      "DS",
                      "IS",
                      "UL",
                      "OF",
                      "OD",
                      "\xFE\xFF\x00\xE0"sv,
                      "\xFE\xFF\x0D\xE0",
                      "\xFE\xFF\xDD\xE0",
                      "\xFF\xFF\xFF\xFF",
                      "\xE0\x7F\x10",
                      "1.2.840.10008.1.2",
                      "1.2.840.10008.1.2.1",
                      "1.2.840.10008.1.2.1.99",
                      "1.2.840.10008.1.2.2",
                      "1.2.840.10008.1.2.5",
                      "1.2.840.10008.1.2.4.70",
                      "1.2.840.10008.1.2.4.80",
                      "1.2.840.10008.1.2.4.90",
                      "MONOCHROME2",
                      "CLOSED_PLANAR",
                      "1e308",
                      "-1 ",
                      "99999999",
                      kPartMark};
const Words kCodestream = {"\xFF\x4F", "\xFF\x51", "\xFF\x52", "\xFF\x53", "\xFF\x5C", "\xFF\x5D",
                           "\xFF\x5E", "\xFF\x90", "\xFF\x93", "\xFF\xD9", "\xFF\xC3", "\xFF\xC4",
                           "\xFF\xDA", "\xFF\xF7", "\xFF\xF8", "\xFF\xD8", "\xFF\xDD", "\xFF\x64"};

}  // namespace

std::vector<FuzzReader> dicom_readers() {
  return {
      {"dicom", read_dicom_image, dicom_image_seeds, kDicom, 1000, refused_dicom_images},
      {"dicom-folder", read_series, dicom_series_seeds, kDicom, 480, refused_dicom_series},
      {"dicom-zip",
       read_zipped_series,
       zipped_dicom_seeds,
       {"PK\x03\x04", "PK\x01\x02", "PK\x05\x06"},
       600,
       refused_dicom_zips},
      {"dicom-codestream", read_codestream_of_frame, dicom_codestream_seeds, kCodestream, 1600},
      {"dicom-segmentation", read_dicom_mask, dicom_segmentation_seeds, kDicom, 1000},
      {"dicom-contours", read_dicom_mask, dicom_contour_seeds, kDicom, 1000},
  };
}

}  // namespace organbake
