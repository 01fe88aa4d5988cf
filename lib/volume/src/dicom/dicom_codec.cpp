// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_codec.h"

#include <gdcmFragment.h>
#include <gdcmImage.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>

#include <mutex>

#include "organbake/core/error.h"

namespace organbake {
namespace {

// GDCM talks to std::cerr; its words reach the user through exceptions.
void keep_off_the_terminal() {
  static std::once_flag once;
  std::call_once(once, [] {
    gdcm::Trace::DebugOff();
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
  });
}

gdcm::SmartPointer<gdcm::Image> image_of(const DicomSlice& slice,
                                         const std::vector<std::byte>& stream) {
  const DicomPixels& pixels = slice.pixels;
  gdcm::SmartPointer<gdcm::Image> image = new gdcm::Image;
  image->SetNumberOfDimensions(2);
  image->SetDimension(0, static_cast<unsigned>(slice.columns));
  image->SetDimension(1, static_cast<unsigned>(slice.rows));
  image->SetPixelFormat(gdcm::PixelFormat(1, static_cast<unsigned short>(pixels.bits_allocated),
                                          static_cast<unsigned short>(pixels.bits_stored),
                                          static_cast<unsigned short>(pixels.bits_stored - 1),
                                          pixels.is_signed ? 1 : 0));
  image->SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  image->SetTransferSyntax(gdcm::TransferSyntax::GetTSType(pixels.transfer_syntax.c_str()));
  gdcm::Fragment fragment;
  fragment.SetByteValue(reinterpret_cast<const char*>(stream.data()),
                        gdcm::VL(static_cast<std::uint32_t>(stream.size())));
  gdcm::SmartPointer<gdcm::SequenceOfFragments> fragments = new gdcm::SequenceOfFragments;
  fragments->AddFragment(fragment);
  gdcm::DataElement data(gdcm::Tag(0x7fe0, 0x0010));
  data.SetVR(gdcm::VR::OB);
  data.SetValue(*fragments);
  image->SetDataElement(data);
  return image;
}

}  // namespace

std::vector<std::byte> decompress(const DicomSlice& slice, DicomCoding coding) {
  keep_off_the_terminal();
  std::vector<std::byte> stream = read_codestream(slice, coding);
  if (stream.size() % 2) stream.push_back(std::byte{0});  // fragments are even by PS3.5
  const std::size_t bytes =
      static_cast<std::size_t>(slice.columns) * slice.rows * (slice.pixels.bits_allocated / 8);
  constexpr std::size_t kStrongestCompression = 2000;  // an empty image as JPEG 2000
  if (bytes / kStrongestCompression > stream.size())
    throw BadDataError(slice.file, "truncated: " + std::to_string(stream.size()) +
                                       " bytes cannot hold " + std::to_string(slice.columns) + "×" +
                                       std::to_string(slice.rows) + " pixels");
  const auto image = image_of(slice, stream);
  std::vector<std::byte> values(bytes);
  if (image->GetBufferLength() != bytes ||
      !image->GetBuffer(reinterpret_cast<char*>(values.data()))) {
    throw BadDataError(slice.file, "its compressed pixels are damaged");
  }
  return values;
}

}  // namespace organbake
