// SPDX-License-Identifier: GPL-3.0-or-later
#include <gdcmFragment.h>
#include <gdcmImage.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmSequenceOfFragments.h>
#include <minizip/zip.h>

#include <cmath>

#include "core/files.h"
#include "core/text.h"
#include "fuzz/readers.h"
#include "support/dicom_bytes.h"
#include "support/dicom_mask_bytes.h"
#include "volume/dicom_codec.h"
#include "volume/read_volume.h"

namespace organbake {
namespace {

using namespace std::string_view_literals;

void read_dicom_image(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_volume(folder.file("image.dcm", bytes));
}

void read_dicom_mask(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_volume(folder.file("mask.dcm", bytes), {.is_mask = true});
}

const std::vector<std::string> kSeries = {"1", "2", "3", "4", "DICOMDIR", "note.txt"};

void read_series(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_volume(folder.parts(kSeries, bytes));
}

void read_zipped_series(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_volume(folder.file("series.zip", bytes));
}

// The first byte says which; the rest is one frame's codestream, in a fragment of its own behind a
// sound header.
constexpr const char* kSyntaxes[] = {"1.2.840.10008.1.2.5", "1.2.840.10008.1.2.4.70",
                                     "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.90"};
constexpr int kSide = 16;

DicomBytes slice_at(double z_mm, int side) {
  DicomBytes slice;
  slice.set_position({5, -8, z_mm});
  slice.rows = slice.columns = static_cast<std::uint16_t>(side);
  for (int i = 0; i < side * side; ++i)
    slice.pixels.push_back(static_cast<std::uint16_t>(900 + 40 * (i % side) + z_mm));
  return slice;
}

std::string item(std::string bytes) {
  if (bytes.size() % 2) bytes += '\0';
  return dicom_number(0xE000FFFE, 4) + dicom_number(static_cast<std::uint32_t>(bytes.size()), 4) +
         bytes;
}

std::string encapsulated(const std::string& syntax, const std::string& codestream) {
  DicomBytes slice = slice_at(0, kSide);
  slice.transfer_syntax = syntax;
  slice.pixels.clear();
  std::string file = slice.bytes();
  file.resize(file.size() - 12);  // the empty pixel data: tag, OW, two zeros, length
  return file + dicom_number(0x00107FE0, 4) + std::string("OB\0\0", 4) +
         dicom_number(0xFFFFFFFF, 4) + item({}) + item(codestream) + dicom_number(0xE0DDFFFE, 4) +
         dicom_number(0, 4);
}

void read_codestream_of_frame(std::span<const std::byte> bytes, const InputFolder& folder) {
  if (bytes.empty()) return;
  const char* syntax = kSyntaxes[std::to_integer<unsigned>(bytes[0]) % std::size(kSyntaxes)];
  const std::string file = encapsulated(syntax, text_of(bytes.subspan(1)));
  const ScannedFile scanned = scan_dicom_file(folder.file("image.dcm", bytes_of(file)));
  if (!scanned.slice) throw BadDataError(scanned.file, scanned.reason);
  decompress(*scanned.slice, coding_of(syntax));
}

// By GDCM's own encoders.
std::string codestream_in(const std::string& syntax) {
  const std::vector<std::uint16_t> pixels = slice_at(0, kSide).pixels;
  const gdcm::SmartPointer<gdcm::Image> image = new gdcm::Image;
  image->SetNumberOfDimensions(2);
  image->SetDimension(0, kSide);
  image->SetDimension(1, kSide);
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

Seeds codestream_seeds() {
  Seeds seeds;
  for (std::size_t i = 0; i < std::size(kSyntaxes); ++i)
    seeds.push_back(static_cast<char>(i) + codestream_in(kSyntaxes[i]));
  return seeds;
}

std::uint32_t number_at(const std::string& bytes, std::size_t at, int count) {
  std::uint32_t value = 0;
  for (int i = count; i-- > 0;)
    value = value << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(i)]);
  return value;
}

// Elements in explicit little-endian without their kinds, and so on in their sequences.
std::string without_kinds(const std::string& elements) {
  constexpr std::size_t kItemHead = 8;
  std::string all;
  for (std::size_t at = 0; at + kItemHead <= elements.size();) {
    const std::string kind = elements.substr(at + 4, 2);
    const bool is_long = kind == "OB" || kind == "OW" || kind == "SQ";
    const std::size_t value = at + (is_long ? 12 : 8);
    const std::size_t length = number_at(elements, is_long ? at + 8 : at + 6, is_long ? 4 : 2);
    std::string content = elements.substr(value, length);
    if (kind == "SQ") {
      std::string items;
      for (std::size_t i = 0; i + kItemHead <= content.size();) {
        const std::size_t bytes = number_at(content, i + 4, 4);
        const std::string inside = without_kinds(content.substr(i + kItemHead, bytes));
        items += content.substr(i, 4) + dicom_number(static_cast<std::uint32_t>(inside.size()), 4) +
                 inside;
        i += kItemHead + bytes;
      }
      content = items;
    }
    all += elements.substr(at, 4) + dicom_number(static_cast<std::uint32_t>(content.size()), 4) +
           content;
    at = value + length;
  }
  return all;
}

// A file as old archives hold it: implicit little-endian.
std::string as_implicit(const std::string& file) {
  constexpr std::size_t kMetaLengthEnd = 144;  // behind the preamble and the group's length
  const std::size_t data_set = kMetaLengthEnd + number_at(file, kMetaLengthEnd - 4, 4);
  return dicom_head("1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.1.2") +
         without_kinds(file.substr(data_set));
}

Seeds image_seeds() {
  return {as_implicit(enhanced_ct({slice_at(0, 4), slice_at(2, 4)})),
          enhanced_ct({slice_at(0, 4), slice_at(2, 4)}),
          enhanced_ct({slice_at(0, 3), slice_at(2, 3), slice_at(5, 3)})};
}

Seeds mask_seeds() {
  const auto frame = [](int step, int value) {
    std::vector<int> values(35, 0);
    for (std::size_t i = 0; i < values.size(); i += static_cast<std::size_t>(step))
      values[i] = value;
    return values;
  };
  return {SegBytes{"BINARY", 1, {{1, 12, frame(2, 1)}, {2, 6, frame(3, 1)}, {1, 9, frame(5, 1)}}}
              .bytes(),
          SegBytes{"FRACTIONAL", 8, {{1, 0, frame(2, 150)}, {1, 3, frame(3, 99)}}}.bytes(),
          SegBytes{"FRACTIONAL", 8, {{1, 0, frame(7, 150)}, {1, 3, frame(9, 99)}}, true}.bytes()};
}

Seeds contour_seeds() {
  Roi organ{"liver", {}};
  for (const double z : {0., 2., 4.}) {
    organ.contours.push_back({z, {{0, 0}, {20, 0}, {20, 15}, {0, 15}}});
    organ.contours.push_back({z, {{5, 5}, {9, 5}, {7, 9}}});
  }
  return {structure_set({organ}), as_implicit(structure_set({organ}))};
}

std::string directory_of(int slices) {
  std::vector<std::string> records;
  for (int k = 1; k <= slices; ++k)
    records.push_back(dicom_element(4, 0x1430, "CS", "IMAGE") +
                      dicom_element(4, 0x1500, "CS", std::to_string(k)));
  return dicom_head("1.2.840.10008.1.3.10") + dicom_sequence(4, 0x1220, records);
}

Seeds series_seeds() {
  const std::string first = slice_at(0, 3).bytes(), second = slice_at(2, 3).bytes();
  return {joined_parts({{0, first}, {1, second}, {2, slice_at(4, 3).bytes()}, {5, "a note"}}),
          joined_parts({{0, first}, {1, second}, {2, second}, {3, slice_at(7, 3).bytes()}}),
          joined_parts({{0, first}, {1, second}, {4, directory_of(2)}})};
}

Seeds zip_seeds() {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "a.zip").string();
  zipFile zip = zipOpen64(path.c_str(), APPEND_STATUS_CREATE);
  for (const double z : {0., 2., 4.}) {
    const std::string name = "a/" + to_text(z), bytes = slice_at(z, 3).bytes();
    const zip_fileinfo info{};
    zipOpenNewFileInZip64(zip, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, 6,
                          0);
    zipWriteInFileInZip(zip, bytes.data(), static_cast<unsigned>(bytes.size()));
    zipCloseFileInZip(zip);
  }
  zipClose(zip, nullptr);
  return {read_text_file(path)};
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
      {"dicom", read_dicom_image, image_seeds, kDicom, 1000},
      {"dicom-folder", read_series, series_seeds, kDicom, 480},
      {"dicom-zip", read_zipped_series, zip_seeds, {"PK\x03\x04", "PK\x01\x02", "PK\x05\x06"}, 600},
      {"dicom-codestream", read_codestream_of_frame, codestream_seeds, kCodestream, 1600},
      {"dicom-segmentation", read_dicom_mask, mask_seeds, kDicom, 1000},
      {"dicom-contours", read_dicom_mask, contour_seeds, kDicom, 1000},
  };
}

}  // namespace organbake
