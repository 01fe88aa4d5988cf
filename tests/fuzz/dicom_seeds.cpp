// SPDX-License-Identifier: GPL-3.0-or-later
#include <gdcmFragment.h>
#include <gdcmImage.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmSequenceOfFragments.h>
#include <minizip/zip.h>
#include <zlib.h>

#include <Eigen/Geometry>

#include "fuzz/seeds.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
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

namespace {

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

std::string codestream_of_slice(const std::string& syntax) {
  return codestream_in(syntax, slice_at(0, kSide).pixels, kSide);
}

// A number of two bytes of the header in place of another.
std::string with_number(std::string file, std::uint16_t group, std::uint16_t element,
                        std::uint32_t number) {
  const std::string head = dicom_element(group, element, "US", dicom_number(0, 2)).substr(0, 8);
  const std::size_t at = file.find(head);
  return at == file.npos ? file : file.replace(at + head.size(), 2, dicom_number(number, 2));
}

// Pixels of one byte: the same file, of which half of the pixels are left over.
std::string of_bytes(const std::string& file, bool is_signed) {
  std::string bytes = with_number(with_number(file, 0x28, 0x0100, 8), 0x28, 0x0101, 8);
  return with_number(with_number(bytes, 0x28, 0x0102, 7), 0x28, 0x0103, is_signed);
}

using Parts = std::vector<std::pair<std::size_t, std::string>>;

// Slices of 3×3 pixels at these heights, six at most, each as `change` leaves it.
template <class Change>
Parts changed_slices(std::initializer_list<double> heights_mm, const Change& change) {
  constexpr std::size_t kNames[] = {0, 1, 2, 3, 6, 7};  // of images, among a folder's files
  Parts parts;
  for (const double z : heights_mm) {
    DicomBytes slice = slice_at(z, 3);
    change(slice, parts.size());
    parts.emplace_back(kNames[parts.size()], slice.bytes());
  }
  return parts;
}

Parts slices_at(std::initializer_list<double> heights_mm) {
  return changed_slices(heights_mm, [](DicomBytes&, std::size_t) {});
}

// Two volumes of the same places, and what tells them apart: `set` is given 1 or 2.
template <class Set>
std::string two_volumes(const Set& set) {
  return joined_parts(changed_slices({0, 2, 4, 0, 2}, [&](DicomBytes& slice, std::size_t k) {
    set(slice, k < 3 ? "1" : "2");
    slice.pixels[0] = static_cast<std::uint16_t>(k);
  }));
}

// What makes a series other than one even volume.
Seeds uneven_series() {
  const auto tilted = [](DicomBytes& slice, std::size_t k) {
    slice.set_position({0, static_cast<double>(k), 3 * static_cast<double>(k)});
  };
  const auto of_two_series = [](DicomBytes& slice, std::size_t k) {
    if (k > 1) slice.series_uid = "1.2.4";
    slice.series_number = k > 1 ? "11" : "2";
  };
  const auto with_strays = [](DicomBytes& slice, std::size_t k) {
    if (k == 1) slice.image_type = "ORIGINAL\\PRIMARY\\LOCALIZER";
    if (k == 2) slice.modality = "MR";
    if (k == 3) slice.position = "";
  };
  return {joined_parts(slices_at({0, 2, 6, 8})),
          joined_parts(slices_at({0, 2, 2, 7})),
          joined_parts(changed_slices({0, 2, 4}, tilted)),
          joined_parts(changed_slices({0, 2, 4, 6}, of_two_series)),
          joined_parts(changed_slices({0, 2, 4, 6, 8, 10}, with_strays)),
          two_volumes([](DicomBytes& s, const char* which) { s.temporal_position = which; }),
          two_volumes([](DicomBytes& s, const char* which) { s.kernel = which; }),
          two_volumes([](DicomBytes& s, const char* which) { s.acquisition = which; })};
}

template <class Change>
std::string both_slices(const Change& change) {
  return joined_parts(
      changed_slices({0, 2}, [&](DicomBytes& slice, std::size_t) { change(slice); }));
}

// What pixels may be.
Seeds pixel_series() {
  const auto padded = [](DicomBytes& slice) {
    slice.padding = 900;
    slice.intercept = "-2048";
  };
  Seeds seeds = {both_slices([](DicomBytes& slice) { slice.is_signed = true; }),
                 both_slices(padded), both_slices([](DicomBytes& slice) { slice.slope = "0.5"; })};
  const std::string a = slice_at(0, 3).bytes(), b = slice_at(2, 3).bytes();
  for (const bool is_signed : {false, true})
    seeds.push_back(joined_parts({{0, of_bytes(a, is_signed)}, {1, of_bytes(b, is_signed)}}));
  seeds.push_back(joined_parts({{0, as_deflated(a)}, {1, as_implicit(b)}}));
  for (const char* syntax : kSyntaxes) {
    const std::string codestream = codestream_of_slice(syntax);
    seeds.push_back(joined_parts(
        {{0, dicom_around(syntax, codestream, 0)}, {1, dicom_around(syntax, codestream, 2)}}));
  }
  return seeds;
}

std::string directory_of(const std::vector<std::string>& names) {
  std::vector<std::string> records;
  for (const std::string& name : names)
    records.push_back(dicom_element(4, 0x1430, "CS", "IMAGE") +
                      dicom_element(4, 0x1500, "CS", name));
  return dicom_head("1.2.840.10008.1.3.10") + dicom_sequence(4, 0x1220, records);
}

// A folder as a disc has it, with a directory that lists these files.
std::string disc_of(const std::vector<std::string>& names) {
  constexpr std::size_t kDirectory = 4;
  Parts parts = slices_at({0, 2});
  parts.emplace_back(kDirectory, directory_of(names));
  return joined_parts(parts);
}

std::string zipped(const std::vector<std::pair<std::string, std::string>>& files) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "a.zip").string();
  zipFile zip = zipOpen64(path.c_str(), APPEND_STATUS_CREATE);
  for (const auto& [name, bytes] : files) {
    const zip_fileinfo info{};
    zipOpenNewFileInZip64(zip, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, 6,
                          0);
    zipWriteInFileInZip(zip, bytes.data(), static_cast<unsigned>(bytes.size()));
    zipCloseFileInZip(zip);
  }
  zipClose(zip, nullptr);
  return read_text_file(path);
}

}  // namespace

std::string codestream_syntax(unsigned which) { return kSyntaxes[which % std::size(kSyntaxes)]; }

std::string dicom_around(const std::string& syntax, const std::string& codestream, double z_mm) {
  DicomBytes slice = slice_at(z_mm, kSide);
  slice.transfer_syntax = syntax;
  slice.pixels.clear();
  std::string file = slice.bytes();
  file.resize(file.size() - 12);  // the empty pixel data: tag, OW, two zeros, length
  return file + dicom_number(0x00107FE0, 4) + std::string("OB\0\0", 4) +
         dicom_number(0xFFFFFFFF, 4) + item({}) + item(codestream) + dicom_number(0xE0DDFFFE, 4) +
         dicom_number(0, 4);
}

Seeds dicom_codestream_seeds() {
  Seeds seeds;
  for (std::size_t i = 0; i < std::size(kSyntaxes); ++i)
    seeds.push_back(static_cast<char>(i) + codestream_of_slice(kSyntaxes[i]));
  return seeds;
}

Seeds dicom_image_seeds() {
  const std::string two = enhanced_ct({slice_at(0, 4), slice_at(2, 4)});
  std::vector<DicomBytes> moments = {slice_at(0, 4), slice_at(2, 4), slice_at(0, 4),
                                     slice_at(2, 4)};
  for (std::size_t k = 0; k < moments.size(); ++k) {
    moments[k].temporal_position = k < 2 ? "1" : "2";
    moments[k].pixels[0] = static_cast<std::uint16_t>(k);
  }
  return {as_implicit(two),
          as_implicit(two, true),
          as_deflated(two),
          two,
          enhanced_ct({slice_at(0, 3), slice_at(2, 3), slice_at(5, 3)}),
          enhanced_ct(moments),
          of_bytes(two, true)};
}

Seeds dicom_series_seeds() {
  Parts with_note = slices_at({0, 2, 4});
  with_note.emplace_back(5, "a note");
  Seeds seeds = {joined_parts(with_note), disc_of({"1", "2"}), disc_of({"1", "2", "LOST"})};
  append(uneven_series(), seeds);
  append(pixel_series(), seeds);
  return seeds;
}

Seeds zipped_dicom_seeds() {
  std::vector<std::pair<std::string, std::string>> files;
  for (const double z : {0., 2., 4.}) files.emplace_back("a/" + to_text(z), slice_at(z, 3).bytes());
  const std::string series = zipped(files);
  return {series,
          zipped({{"__MACOSX/a", "x"}, {"ct.dcm", enhanced_ct({slice_at(0, 4), slice_at(2, 4)})}})};
}

Seeds refused_dicom_images() {
  return {slice_at(0, 4).bytes(), directory_of({"1"}), structure_set({})};
}

Seeds refused_dicom_series() {
  return {joined_parts(slices_at({0, 2, 4, 40})),
          disc_of({"A\\1"}),
          disc_of({".."}),
          disc_of({}),
          two_volumes([](DicomBytes&, const char*) {}),
          both_slices([](DicomBytes& slice) { slice.photometric = "MONOCHROME1"; }),
          both_slices([](DicomBytes& slice) { slice.transfer_syntax = "1.2.840.10008.1.2.4.50"; }),
          both_slices([](DicomBytes& slice) { slice.transfer_syntax = "1.2.3"; }),
          both_slices([](DicomBytes& slice) { slice.modality = "MR"; })};
}

Seeds refused_dicom_zips() {
  const std::string note = zipped({{"note.txt", "a note"}});
  return {note, zipped({{"again.zip", note}}), zipped({})};
}

Seeds dicom_segmentation_seeds() {
  const auto frame = [](int step, int value) {
    std::vector<int> values(35, 0);
    for (std::size_t i = 0; i < values.size(); i += static_cast<std::size_t>(step))
      values[i] = value;
    return values;
  };
  const std::string bits =
      SegBytes{"BINARY", 1, {{1, 12, frame(2, 1)}, {2, 6, frame(3, 1)}, {1, 9, frame(5, 1)}}}
          .bytes();
  return {bits,
          as_deflated(bits),
          as_implicit(bits, true),
          SegBytes{"LABELMAP", 8, {{1, 0, frame(2, 1)}, {1, 3, frame(3, 2)}}}.bytes(),
          SegBytes{"FRACTIONAL", 8, {{1, 0, frame(2, 150)}, {1, 3, frame(3, 99)}}}.bytes(),
          SegBytes{"FRACTIONAL", 8, {{1, 0, frame(7, 150)}, {1, 3, frame(9, 99)}}, true}.bytes()};
}

Seeds dicom_contour_seeds() {
  Roi organ{"liver", {}}, vessel{"vessel", {}};
  for (const double z : {0., 2., 4.}) {
    organ.contours.push_back({z, {{0, 0}, {20, 0}, {20, 15}, {0, 15}}});
    organ.contours.push_back({z, {{5, 5}, {9, 5}, {7, 9}}});
    if (z != 2) vessel.contours.push_back({z, {{1, 1}, {3, 1}, {2, 3}}});
  }
  const Eigen::Matrix3d oblique =
      Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
  return {structure_set({organ}), structure_set({organ, vessel}),
          structure_set({vessel, organ}, oblique),
          as_implicit(structure_set({organ, vessel}), true), as_deflated(structure_set({organ}))};
}

}  // namespace organbake
