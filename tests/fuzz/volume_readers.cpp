// SPDX-License-Identifier: GPL-3.0-or-later
// Volumes and masks that are not DICOM.
#include "fuzz/readers.h"
#include "fuzz/volume_seeds.h"
#include "fuzz/volumes_as_asked.h"

namespace organbake {
namespace {

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

}  // namespace organbake
