// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/dicom_pixels.h"

#include <tbb/parallel_for.h>
#include <vtkDICOMReader.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>

#include <array>

#include "core/error.h"
#include "formats/vtk_error_log.h"
#include "volume/voxel_decoding.h"

namespace organbake {
namespace {

// JPEG processes 1, 2 & 4, 6 & 8, 10 & 12: lossy, 8 or 12 bits. GDCM decodes such CTs to garbage
// without an error.
constexpr std::array<const char*, 4> kLossyJpeg = {
    "1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51", "1.2.840.10008.1.2.4.53",
    "1.2.840.10008.1.2.4.55"};

void check_pixel_kind(const DicomSlice& slice) {
  for (const char* uid : kLossyJpeg) {
    if (slice.transfer_syntax == uid) {
      throw BadDataError(slice.file, std::string("is stored as lossy JPEG (") + uid +
                                         "), which cannot hold CT values; export it uncompressed "
                                         "or as JPEG 2000");
    }
  }
  if (slice.photometric != "MONOCHROME2") {
    throw BadDataError(slice.file, "has photometric interpretation \"" + slice.photometric +
                                       "\"; a CT is MONOCHROME2");
  }
  if (slice.frames != 1) {
    throw BadDataError(slice.file,
                       "is a multi-frame CT, which is not read; export single-frame "
                       "slices");
  }
}

VoxelType type_of(vtkImageData& image, const DicomSlice& slice) {
  switch (image.GetScalarType()) {
    case VTK_SIGNED_CHAR:
    case VTK_CHAR:
      return VoxelType::int8;
    case VTK_UNSIGNED_CHAR:
      return VoxelType::uint8;
    case VTK_SHORT:
      return VoxelType::int16;
    case VTK_UNSIGNED_SHORT:
      return VoxelType::uint16;
    case VTK_INT:
      return VoxelType::int32;
    case VTK_UNSIGNED_INT:
      return VoxelType::uint32;
    default:
      throw BadDataError(slice.file, "its pixels are not integers");
  }
}

void decode_slice(const DicomSlice& slice, Volume& volume, std::size_t k, ConversionLoss& loss) {
  check_pixel_kind(slice);
  vtkNew<vtkDICOMReader> reader;
  VtkErrorLog errors;
  errors.watch(reader);
  reader->SetFileName(slice.file.c_str());
  reader->SetMemoryRowOrderToFileNative();  // the first row stays the first
  reader->AutoRescaleOff();                 // done below, in one pass with the move to int16
  reader->Update();
  errors.throw_if_any(slice.file);
  vtkImageData& image = *reader->GetOutput();
  const int* size = image.GetDimensions();
  if (reader->GetErrorCode() != 0 || size[0] != slice.columns || size[1] != slice.rows ||
      size[2] != 1 || image.GetNumberOfScalarComponents() != 1) {
    throw BadDataError(slice.file, "its pixels cannot be decoded");
  }
  const std::size_t count = static_cast<std::size_t>(size[0]) * size[1];
  const VoxelEncoding encoding{type_of(image, slice), false, slice.slope, slice.intercept};
  convert_voxels(static_cast<const std::byte*>(image.GetScalarPointer()), count, encoding, volume,
                 k * count, loss);
}

}  // namespace

void decode_stack(const DicomStack& stack, Volume& volume, const RunContext& context) {
  const std::size_t slices = stack.slices.size();
  volume.voxels.resize(slices * volume.size[0] * volume.size[1]);
  std::vector<ConversionLoss> losses(slices);
  tbb::parallel_for(std::size_t{0}, slices, [&](std::size_t k) {
    context.throw_if_cancelled();
    decode_slice(stack.slices[k], volume, k, losses[k]);
  });
  ConversionLoss total;
  for (const ConversionLoss& loss : losses) total.add(loss);
  settle_losses(total, volume, stack.slices.front().file.parent_path().string());
}

}  // namespace organbake
