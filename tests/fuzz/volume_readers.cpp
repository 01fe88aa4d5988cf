// SPDX-License-Identifier: GPL-3.0-or-later
// Volumes and masks that are not DICOM.
#include "volume/read_volume.h"

#include "core/files.h"
#include "core/text.h"
#include "fuzz/readers.h"
#include "support/nifti_bytes.h"
#include "support/ramp_volume.h"
#include "volume/write_volume.h"

namespace organbake {
namespace {

void read_nifti_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_volume(folder.file("scan.nii", bytes));
}

void read_nrrd_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_volume(folder.file("scan.nrrd", bytes));
}

void read_mask_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_volume(folder.file("mask.seg.nrrd", bytes), {.label = "liver", .is_mask = true});
}

void read_metaimage_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_volume(folder.file("scan.mha", bytes));
}

void read_vti_file(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_volume(folder.file("scan.vti", bytes));
}

// Headers whose voxels lie in other files.
const std::vector<std::string> kDetached = {"scan.nhdr", "scan.mhd", "scan.hdr",
                                            "scan.img",  "1.raw",    "2.raw"};

void read_detached(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path at = folder.parts(kDetached, bytes);
  for (const char* header : {"scan.nhdr", "scan.mhd", "scan.hdr"})
    if (std::filesystem::exists(at / header)) read_volume(at / header);
}

Seeds nifti_seeds() {
  const Volume truth = ramp_volume(oblique_direction());
  NiftiBytes plain(truth), turned(truth), swapped(truth), scaled(truth);
  turned.set_qform(truth);
  turned.sform_code = 0;
  swapped.swap_to_big_endian();
  scaled.slope = 2;
  scaled.intercept = -10;
  return {plain.bytes(), turned.bytes(), swapped.bytes(), scaled.bytes(), plain.bytes_nifti2()};
}

Seeds zipped_nifti_seeds() { return {gzipped(NiftiBytes(ramp_volume()).bytes())}; }

std::string nrrd_header(const std::string& more) {
  return "NRRD0004\n# a comment\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\n"
         "space: left-posterior-superior\nspace directions: (0.8,0,0) (0,1.25,0) (0,0,3)\n"
         "space origin: (-40,25,110)\n" +
         more;
}

std::string as_decimals(const Volume& volume) {
  std::string text;
  for (const std::int16_t voxel : volume.voxels) text += std::to_string(voxel) + " ";
  return text;
}

Seeds nrrd_seeds() {
  const Volume truth = ramp_volume();
  return {nrrd_header("encoding: raw\n\n") + voxel_bytes(truth),
          nrrd_header("encoding: gzip\n\n") + gzipped(voxel_bytes(truth)),
          nrrd_header("encoding: ascii\n\n") + as_decimals(truth),
          nrrd_header("encoding: raw\nbyte skip: -1\nkey:=value\n\n") + voxel_bytes(truth)};
}

// Two segments in two layers, as 3D Slicer saves them.
Seeds mask_seeds() {
  const auto segment = [](int i, const std::string& name, int layer) {
    const std::string key = "Segment" + std::to_string(i) + "_";
    return key + "ID:=S_" + std::to_string(i) + "\n" + key + "Name:=" + name + "\n" + key +
           "LabelValue:=1\n" + key + "Layer:=" + std::to_string(layer) + "\n";
  };
  std::string voxels;
  for (int i = 0; i < 60; ++i) voxels += {static_cast<char>(i < 20), static_cast<char>(i >= 10)};
  return {
      "NRRD0004\ntype: uchar\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 5 4 3\n"
      "space directions: none (1,0,0) (0,1,0) (0,0,2)\nkinds: list domain domain domain\n"
      "encoding: raw\nspace origin: (1,2,3)\n" +
      segment(0, "spleen", 0) + segment(1, "liver", 1) + "\n" + voxels};
}

std::string metaimage_header(const std::string& more, const std::string& data) {
  return "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementSpacing = 0.8 1.25 3\n"
         "Offset = -40 25 110\nElementType = MET_SHORT\n" +
         more + "ElementDataFile = " + data + "\n";
}

Seeds metaimage_seeds() {
  const TemporaryFolder folder;
  write_metaimage(folder.path() / "a.mha", ramp_volume(oblique_direction()));
  return {read_text_file(folder.path() / "a.mha"),
          metaimage_header("", "LOCAL") + voxel_bytes(ramp_volume()),
          metaimage_header("BinaryData = False\nHeaderSize = -1\n", "LOCAL") +
              as_decimals(ramp_volume())};
}

std::string vti_text(const std::string& array) {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" "
         "byte_order=\"LittleEndian\">\n<ImageData WholeExtent=\"0 4 0 3 0 2\" Origin=\"1 2 3\" "
         "Spacing=\"0.8 1.25 3\" Direction=\"1 0 0 0 1 0 0 0 1\">\n<Piece Extent=\"0 4 0 3 0 "
         "2\">\n<" +
         array +
         ">\n<DataArray type=\"Int16\" Name=\"hu\" NumberOfComponents=\"1\" format=\"ascii\">\n" +
         as_decimals(ramp_volume()) + "\n</DataArray>\n</" + array +
         ">\n</Piece>\n</ImageData>\n</VTKFile>\n";
}

Seeds vti_seeds() { return {vti_text("PointData")}; }

Seeds detached_seeds() {
  const std::string voxels = voxel_bytes(ramp_volume());
  NiftiBytes pair(ramp_volume());
  pair.magic = std::string("ni1\0", 4);
  pair.vox_offset = 0;
  const std::string whole = pair.bytes();
  return {joined_parts({{0, nrrd_header("encoding: raw\ndata file: 1.raw\n")}, {4, voxels}}),
          joined_parts({{0, nrrd_header("encoding: raw\ndata file: %d.raw 1 2 1\n")},
                        {4, voxels.substr(0, 60)},
                        {5, voxels.substr(60)}}),
          joined_parts({{0, nrrd_header("encoding: raw\ndata file: LIST 3\n1.raw\n2.raw\n")},
                        {4, voxels.substr(0, 60)},
                        {5, voxels.substr(60)}}),
          joined_parts({{1, metaimage_header("", "1.raw")}, {4, voxels}}),
          joined_parts({{2, whole.substr(0, 348)}, {3, voxels}})};
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
      {"nifti", read_nifti_file, nifti_seeds, {"n+1", "ni1", "n+2"}, 6000},
      {"nifti-gz", read_nifti_file, zipped_nifti_seeds, {"\x1f\x8b\x08"}, 6000},
      {"nrrd", read_nrrd_file, nrrd_seeds, kNrrd, 6000},
      {"seg-nrrd", read_mask_file, mask_seeds, kNrrd, 6000},
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
       1200},
      {"detached-volume", read_detached, detached_seeds, kNrrd, 2400},
  };
}

}  // namespace organbake
