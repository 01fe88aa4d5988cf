// SPDX-License-Identifier: GPL-3.0-or-later
// Volumes and masks as a user's files reach them, DICOM among them.
#include <algorithm>
#include <filesystem>
#include <string>

#include "dicom/dicom.h"
#include "fuzz/readers.h"
#include "fuzz/seeds.h"
#include "organbake/volume/read_volume.h"

namespace organbake {
namespace {

Region middle_of(const Volume& volume) {
  const Eigen::Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  const Eigen::Vector3d a = volume.world_from_index(0.4 * last);
  const Eigen::Vector3d b = volume.world_from_index(0.6 * last);
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

std::string first_labels(const Volume& mask) {
  constexpr std::size_t kMost = 2;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, mask.label_names.size()); ++i)
    text += (i ? "," : "") + mask.label_names[i].name;
  if (!mask.label_names.empty()) return text;
  std::size_t count = 0;
  for (const LabelCount& one : count_labels(mask))
    if (one.label > 0 && count++ < kMost)
      text += (text.empty() ? "" : ",") + std::to_string(one.label);
  return text;
}

// The volume, and what a user asks for who has seen it: the last of its time points, and of that
// the middle.
void read_all_and_a_part(const std::filesystem::path& path) {
  const Volume volume = read_volume(path, {.any_time = true});
  read_volume(path, {.region = middle_of(volume), .time = static_cast<int>(volume.time_points)});
}

// The mask, and its first two labels: by name where they have names, else by number.
void read_mask_and_labels(const std::filesystem::path& path) {
  const Volume mask = read_volume(path, {.any_time = true, .is_mask = true});
  const std::string labels = first_labels(mask);
  if (labels.empty()) return;
  read_volume(path,
              {.region = middle_of(mask), .any_time = true, .label = labels, .is_mask = true});
}

void read_nifti_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_all_and_a_part(folder.file("scan.nii", bytes));
}

void read_nrrd_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_all_and_a_part(folder.file("scan.nrrd", bytes));
}

void read_mask_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_mask_and_labels(folder.file("mask.seg.nrrd", bytes));
}

void read_metaimage_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_all_and_a_part(folder.file("scan.mha", bytes));
}

void read_vti_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_all_and_a_part(folder.file("scan.vti", bytes));
}

// Headers whose voxels lie in other files.
const std::vector<std::string> kDetached = {"scan.nhdr", "scan.mhd", "scan.hdr",
                                            "scan.img",  "1.raw",    "2.raw"};

void read_detached(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path at = folder.parts(kDetached, bytes);
  for (const char* header : {"scan.nhdr", "scan.mhd", "scan.hdr"})
    if (std::filesystem::exists(at / header)) read_all_and_a_part(at / header);
}

const Words kNrrd = {"type: ",
                     "dimension: ",
                     "sizes: ",
                     "encoding: ",
                     "raw\n",
                     "gzip\n",
                     "bzip2\n",
                     "ascii\n",
                     "hex\n",
                     "endian: big\n",
                     "space directions: ",
                     "none ",
                     "spacings: ",
                     "kinds: ",
                     "list",
                     "data file: ",
                     "LIST\n",
                     "byte skip: ",
                     "line skip: ",
                     "space dimension: 3\n",
                     "double\n",
                     "uchar\n",
                     "(nan,0,0)",
                     "99999999999 ",
                     "-1 ",
                     "Segment0_LabelValue:=",
                     "Segment0_Layer:=",
                     "\n\n"};

}  // namespace

std::vector<FuzzReader> volume_readers() {
  return {
      {"nifti", read_nifti_file, nifti_seeds, {"n+1", "ni1", "n+2"}, 6000, refused_niftis},
      {"nifti-gz",
       read_nifti_file,
       zipped_nifti_seeds,
       {"\x1f\x8b\x08"},
       6000,
       refused_zipped_niftis},
      {"nrrd", read_nrrd_file, nrrd_seeds, kNrrd, 6000},
      {"seg-nrrd", read_mask_file, layered_mask_seeds, kNrrd, 6000},
      {"metaimage",
       read_metaimage_file,
       metaimage_seeds,
       {"NDims = ", "DimSize = ", "ElementType = ", "MET_UCHAR", "MET_DOUBLE",
        "CompressedData = True\n", "CompressedDataSize = ", "ElementDataFile = LOCAL\n", "LIST",
        "HeaderSize = ", "BinaryData = False\n", "BinaryDataByteOrderMSB = True\n",
        "ElementNumberOfChannels = ", "TransformMatrix = ", "-1 ", "99999999999 ", "nan "},
       6000},
      {"vti",
       read_vti_file,
       vti_seeds,
       {"<ImageData", "WholeExtent=\"", "Extent=\"", "Spacing=\"", "Direction=\"", "PointData",
        "CellData", "DataArray", "format=\"binary\"", "format=\"appended\" offset=\"0\"",
        "<AppendedData encoding=\"raw\">_", "Float64", "UInt8", "NumberOfComponents=\"", "-1",
        "99999999999", "header_type=\"UInt64\"", "compressor=\"vtkZLibDataCompressor\""},
       1200,
       refused_vtis},
      {"detached-volume", read_detached, detached_volume_seeds, kNrrd, 2400},
  };
}

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
