// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/dicom_codings.h"

#include <gdcmFragment.h>
#include <gdcmImage.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmSequenceOfFragments.h>
#include <zlib.h>

#include "support/dicom_bytes.h"

namespace organbake {
namespace {

constexpr std::uint32_t kItem = 0xE000FFFE, kItemEnd = 0xE00DFFFE, kSequenceEnd = 0xE0DDFFFE;
constexpr std::uint32_t kUndefined = 0xFFFFFFFF;
constexpr std::size_t kMetaLengthEnd = 144;  // behind the preamble and the group's length

std::uint32_t number_at(const std::string& bytes, std::size_t at, int count) {
  std::uint32_t value = 0;
  for (int i = count; i-- > 0;)
    value = value << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(i)]);
  return value;
}

std::size_t data_set_begin(const std::string& file) {
  return kMetaLengthEnd + number_at(file, kMetaLengthEnd - 4, 4);
}

std::string mark(std::uint32_t tag, std::uint32_t length) {
  return dicom_number(tag, 4) + dicom_number(length, 4);
}

std::uint32_t size_of(const std::string& bytes) { return static_cast<std::uint32_t>(bytes.size()); }

std::string without_kinds(const std::string& elements, bool open);

std::string items_without_kinds(const std::string& items, bool open) {
  constexpr std::size_t kItemHead = 8;
  std::string all;
  for (std::size_t i = 0; i + kItemHead <= items.size();) {
    const std::size_t bytes = number_at(items, i + 4, 4);
    const std::string inside = without_kinds(items.substr(i + kItemHead, bytes), open);
    all += mark(kItem, open ? kUndefined : size_of(inside)) + inside;
    if (open) all += mark(kItemEnd, 0);
    i += kItemHead + bytes;
  }
  return open ? all + mark(kSequenceEnd, 0) : all;
}

// Elements in explicit little-endian without their kinds, and so on in their sequences.
std::string without_kinds(const std::string& elements, bool open) {
  constexpr std::size_t kShortHead = 8, kLongHead = 12;
  std::string all;
  for (std::size_t at = 0; at + kShortHead <= elements.size();) {
    const std::string kind = elements.substr(at + 4, 2);
    const bool is_sequence = kind == "SQ";
    const bool is_long = kind == "OB" || kind == "OW" || is_sequence;
    const std::size_t value = at + (is_long ? kLongHead : kShortHead);
    const std::size_t length = number_at(elements, is_long ? at + 8 : at + 6, is_long ? 4 : 2);
    std::string content = elements.substr(value, length);
    if (is_sequence) content = items_without_kinds(content, open);
    all += elements.substr(at, 4) +
           dicom_number(is_sequence && open ? kUndefined : size_of(content), 4) + content;
    at = value + length;
  }
  return all;
}

}  // namespace

std::string as_implicit(const std::string& file, bool open) {
  return dicom_head("1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.1.2") +
         without_kinds(file.substr(data_set_begin(file)), open);
}

std::string as_deflated(const std::string& file) {
  std::string data_set = file.substr(data_set_begin(file));
  std::string packed(compressBound(data_set.size()), '\0');
  z_stream stream{};
  constexpr int kRawDeflate = -MAX_WBITS, kMemory = 8;
  deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kRawDeflate, kMemory,
               Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(data_set.data());
  stream.avail_in = size_of(data_set);
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = size_of(packed);
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return dicom_head("1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.1.2.1.99") + packed;
}

std::string codestream_in(const std::string& syntax, const std::vector<std::uint16_t>& pixels,
                          int side) {
  const gdcm::SmartPointer<gdcm::Image> image = new gdcm::Image;
  image->SetNumberOfDimensions(2);
  image->SetDimension(0, static_cast<unsigned>(side));
  image->SetDimension(1, static_cast<unsigned>(side));
  image->SetPixelFormat(gdcm::PixelFormat(1, 16, 16, 15, 0));
  image->SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  image->SetTransferSyntax(gdcm::TransferSyntax::ExplicitVRLittleEndian);
  gdcm::DataElement data(gdcm::Tag(0x7fe0, 0x0010));
  data.SetVR(gdcm::VR::OW);
  data.SetByteValue(reinterpret_cast<const char*>(pixels.data()),
                    gdcm::VL(static_cast<std::uint32_t>(2 * pixels.size())));
  image->SetDataElement(data);
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(gdcm::TransferSyntax::GetTSType(syntax.c_str()));
  change.SetInput(*image);
  if (!change.Change()) return {};
  const auto* fragments = change.GetOutput().GetDataElement().GetSequenceOfFragments();
  const gdcm::ByteValue* bytes = fragments->GetFragment(0).GetByteValue();
  return {bytes->GetPointer(), bytes->GetLength()};
}

}  // namespace organbake
