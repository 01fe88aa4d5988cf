// SPDX-License-Identifier: GPL-3.0-or-later
// Decompresses one frame: JPEG, JPEG-LS, JPEG 2000 and run lengths (PS3.5, 8.2), by GDCM. Each
// codestream is looked over before, since the decoders trust it. In, a slice's fragments; out, its
// stored values.
#include <gdcmFragment.h>
#include <gdcmImage.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>
#include <map>
#include <mutex>
#include <optional>
#include <span>

#include "dicom/dicom.h"
#include "files/volume_files.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

using Bytes = std::span<const std::byte>;

unsigned byte_at(Bytes bytes, std::size_t at) { return std::to_integer<unsigned>(bytes[at]); }

std::uint32_t big_endian(Bytes bytes, std::size_t at, std::size_t count) {
  return whole_at(bytes, at, count, true);
}

std::uint32_t little_endian(Bytes bytes, std::size_t at, std::size_t count) {
  return whole_at(bytes, at, count, false);
}

[[noreturn]] void refuse(const DicomSlice& slice, const std::string& why) {
  throw BadDataError(slice.file, "its compressed pixels are damaged: " + why);
}

// What a codestream says about itself.
struct Frame {
  std::uint32_t columns = 0, rows = 0;
  unsigned components = 0, bits = 0;
};

// SOC and SIZ, which stand first (ISO 15444-1, A.5.1).
Frame jpeg_2000_frame(Bytes stream, const DicomSlice& slice) {
  constexpr std::size_t kSizeOfSiz = 43;
  if (stream.size() < kSizeOfSiz || big_endian(stream, 0, 4) != 0xFF4FFF51)
    refuse(slice, "no JPEG 2000 begins there");
  const std::uint32_t left = big_endian(stream, 16, 4), top = big_endian(stream, 20, 4);
  return {big_endian(stream, 8, 4) - left, big_endian(stream, 12, 4) - top,
          big_endian(stream, 40, 2), (byte_at(stream, 42) & 0x7F) + 1};
}

// The markers of a JPEG or JPEG-LS stream of one component (ISO 10918-1, B.2; ISO 14495-1, C.2),
// all of them: a decoder that meets one where it should not be ends the program (GDCM's
// assertions), and one whose stream is cut off goes on with zeros for minutes (CharLS).
class JpegMarkers {
 public:
  JpegMarkers(Bytes stream, bool jpeg_ls, const DicomSlice& slice)
      : stream_(stream), jpeg_ls_(jpeg_ls), slice_(slice) {}

  Frame frame() {
    if (stream_.size() < 4 || big_endian(stream_, 0, 2) != 0xFFD8)
      refuse(slice_, "no JPEG begins there");
    at_ = 2;
    while (true) {
      const unsigned marker = next_marker();
      const Bytes segment = next_segment();
      if (marker == kStartOfScan) {
        check_scan(segment);
        return *frame_;
      }
      if (marker == (jpeg_ls_ ? kJpegLsFrame : kLosslessFrame)) {
        read_frame(segment);
      } else if (!is_table(marker)) {
        refuse(slice_, "its JPEG is of another kind than the header says");
      }
    }
  }

 private:
  static constexpr unsigned kLosslessFrame = 0xC3, kJpegLsFrame = 0xF7, kHuffman = 0xC4;
  static constexpr unsigned kStartOfScan = 0xDA, kEndOfImage = 0xD9, kJpegLsTables = 0xF8;

  unsigned next_marker() {
    if (at_ + 2 > stream_.size() || byte_at(stream_, at_) != 0xFF)
      refuse(slice_, "a marker is missing");
    while (at_ < stream_.size() && byte_at(stream_, at_) == 0xFF) ++at_;  // fill
    if (at_ == stream_.size()) refuse(slice_, "they end too early");
    return byte_at(stream_, at_++);
  }

  Bytes next_segment() {
    const std::size_t left = stream_.size() - at_;
    const std::size_t length = left < 2 ? 0 : big_endian(stream_, at_, 2);
    if (length < 2 || length > left) refuse(slice_, "a segment of their JPEG is cut off");
    const Bytes segment = stream_.subspan(at_ + 2, length - 2);
    at_ += length;
    return segment;
  }

  // Comments, applications' own data, restart intervals and the tables that decoders check.
  bool is_table(unsigned marker) {
    if (marker == kHuffman) has_huffman_ = true;
    return (marker >= 0xE0 && marker <= 0xEF) || marker == 0xFE || marker == 0xDD ||
           marker == 0xDB || (marker == kHuffman && !jpeg_ls_) ||
           (marker == kJpegLsTables && jpeg_ls_);
  }

  void read_frame(Bytes segment) {
    constexpr std::size_t kFrameOfOne = 9;
    if (frame_ || segment.size() < kFrameOfOne) refuse(slice_, "its JPEG has no sound frame");
    frame_ = Frame{big_endian(segment, 3, 2), big_endian(segment, 1, 2), byte_at(segment, 5),
                   byte_at(segment, 0)};
    if (frame_->components == 1 && segment.size() != kFrameOfOne)
      refuse(slice_, "its JPEG has no sound frame");
  }

  // One scan, with nothing but restarts in it and the end behind it.
  void check_scan(Bytes segment) {
    constexpr std::size_t kScanOfOne = 6;
    if (!frame_ || (frame_->components == 1 && segment.size() != kScanOfOne) ||
        (!jpeg_ls_ && !has_huffman_))
      refuse(slice_, "its JPEG has no sound scan");
    for (; at_ + 1 < stream_.size(); ++at_) {
      if (byte_at(stream_, at_) != 0xFF) continue;
      const unsigned next = byte_at(stream_, at_ + 1);
      const bool data = jpeg_ls_ ? next < 0x80 : next == 0;
      if (data || next == 0xFF || (next >= 0xD0 && next <= 0xD7)) continue;
      if (next != kEndOfImage) refuse(slice_, "something else than pixels is among them");
      return;
    }
    refuse(slice_, "they end too early");
  }

  Bytes stream_;
  bool jpeg_ls_;
  const DicomSlice& slice_;
  std::size_t at_ = 0;
  std::optional<Frame> frame_;
  bool has_huffman_ = false;
};

// The table of the segments, one for each byte of a pixel (PS3.5, G.5).
void check_rle(Bytes stream, const DicomSlice& slice) {
  constexpr std::size_t kTable = 64;
  const auto wanted = static_cast<std::uint32_t>(slice.pixels.bits_allocated / 8);
  if (stream.size() < kTable || little_endian(stream, 0, 4) != wanted)
    refuse(slice, "its RLE table does not fit the header");
  std::uint32_t last = kTable - 1;
  for (std::uint32_t i = 0; i < wanted; ++i) {
    const std::uint32_t offset = little_endian(stream, 4 + 4 * i, 4);
    if (offset <= last || offset >= stream.size()) refuse(slice, "its RLE table is wrong");
    last = offset;
  }
}

void check_frame(const Frame& frame, const DicomSlice& slice) {
  const bool same_size = frame.columns == static_cast<std::uint32_t>(slice.columns) &&
                         frame.rows == static_cast<std::uint32_t>(slice.rows);
  if (!same_size || frame.components != 1)
    refuse(slice, "they are " + std::to_string(frame.columns) + "×" + std::to_string(frame.rows) +
                      " of " + std::to_string(frame.components) + " components, the header says " +
                      std::to_string(slice.columns) + "×" + std::to_string(slice.rows) + " of 1");
  const bool wide_container = slice.pixels.bits_allocated == 16;
  if (frame.bits < 2 || frame.bits > static_cast<unsigned>(slice.pixels.bits_allocated) ||
      (wide_container && frame.bits <= 8 && slice.pixels.bits_stored > 8))
    refuse(slice, "they have " + std::to_string(frame.bits) + " bits, the header says " +
                      std::to_string(slice.pixels.bits_stored));
}

// Where the fragments of compressed pixels lie in the file, and the table of offsets before them.
struct Fragments {
  struct Piece {
    std::uint64_t item, bytes;  // the item's own offset behind the table, and its content's size
  };
  std::vector<std::uint64_t> frame_offsets;
  std::vector<Piece> pieces;
  std::uint64_t begin = 0;  // in the file, of what follows the table
};

Fragments find_fragments(const DicomSlice& slice) {
  constexpr std::uint32_t kItem = 0xE000FFFE, kDelimiter = 0xE0DDFFFE;  // as little-endian words
  ByteStream file(slice.file, ByteStream::Coding::raw, slice.pixels.offset);
  Fragments found;
  std::array<std::byte, 8> head;
  std::uint64_t at = 0;  // behind the table of offsets
  for (bool offsets = true;; offsets = false) {
    file.read_exactly(head);
    const std::uint32_t tag = little_endian(head, 0, 4), length = little_endian(head, 4, 4);
    if (tag == kDelimiter) return found;
    if (tag != kItem || length > file.most_possible_bytes()) refuse(slice, "a fragment is missing");
    if (offsets) {
      std::vector<std::byte> table(length);
      file.read_exactly(table);
      for (std::size_t i = 0; i + 4 <= table.size(); i += 4)
        found.frame_offsets.push_back(little_endian(table, i, 4));
      found.begin = slice.pixels.offset + head.size() + length;
      continue;
    }
    found.pieces.push_back({at, length});
    at += head.size() + length;
    file.skip(length);
  }
}

// The fragments that hold one frame: all of them when there is but one, one each when there are as
// many, else what the table of offsets says.
std::vector<Fragments::Piece> pieces_of_frame(const Fragments& all, const DicomSlice& slice) {
  const auto frames = static_cast<std::size_t>(slice.pixels.frames);
  const auto frame = static_cast<std::size_t>(slice.frame);
  if (frames <= 1) return all.pieces;
  if (all.pieces.size() == frames) return {all.pieces[frame]};
  if (all.frame_offsets.size() != frames) refuse(slice, "nothing says where its frames begin");
  const std::uint64_t from = all.frame_offsets[frame];
  const std::uint64_t to = frame + 1 < frames ? all.frame_offsets[frame + 1] : ~std::uint64_t{0};
  std::vector<Fragments::Piece> pieces;
  for (const Fragments::Piece& piece : all.pieces)
    if (piece.item >= from && piece.item < to) pieces.push_back(piece);
  return pieces;
}

std::vector<std::byte> joined_fragments(const DicomSlice& slice) {
  constexpr std::uint64_t kItemHead = 8;
  const Fragments all = find_fragments(slice);
  std::vector<std::byte> stream;
  for (const Fragments::Piece& piece : pieces_of_frame(all, slice)) {
    ByteStream file(slice.file, ByteStream::Coding::raw, all.begin + piece.item + kItemHead);
    const std::size_t before = stream.size();
    stream.resize(before + static_cast<std::size_t>(piece.bytes));
    file.read_exactly(std::span(stream).subspan(before));
  }
  return stream;
}

}  // namespace

DicomCoding coding_of(const std::string& transfer_syntax) {
  static const std::map<std::string, DicomCoding> kCodings = {
      {"", DicomCoding::native},
      {"1.2.840.10008.1.2", DicomCoding::native},       // implicit little-endian
      {"1.2.840.10008.1.2.1", DicomCoding::native},     // explicit little-endian
      {"1.2.840.10008.1.2.1.99", DicomCoding::native},  // the same, deflated as a whole
      {"1.2.840.10008.1.2.2", DicomCoding::native},     // explicit big-endian
      {"1.2.840.10008.1.2.4.50", DicomCoding::lossy_jpeg},
      {"1.2.840.10008.1.2.4.51", DicomCoding::lossy_jpeg},
      {"1.2.840.10008.1.2.4.53", DicomCoding::lossy_jpeg},
      {"1.2.840.10008.1.2.4.55", DicomCoding::lossy_jpeg},
      {"1.2.840.10008.1.2.4.57", DicomCoding::lossless_jpeg},
      {"1.2.840.10008.1.2.4.70", DicomCoding::lossless_jpeg},
      {"1.2.840.10008.1.2.4.80", DicomCoding::jpeg_ls},
      {"1.2.840.10008.1.2.4.81", DicomCoding::jpeg_ls},
      {"1.2.840.10008.1.2.4.90", DicomCoding::jpeg_2000},
      {"1.2.840.10008.1.2.4.91", DicomCoding::jpeg_2000},
      {"1.2.840.10008.1.2.5", DicomCoding::rle}};
  const auto found = kCodings.find(transfer_syntax);
  return found == kCodings.end() ? DicomCoding::unknown : found->second;
}

namespace {

// Reads the fragments of compressed pixel data (PS3.5, A.4) and joins them: one frame's codestream.
// Then holds what the codestream says about itself against the header: the decoders take a lie for
// a reason to end the program, so they must not see one. Throws BadDataError naming the file.
std::vector<std::byte> read_codestream(const DicomSlice& slice, DicomCoding coding) {
  if (slice.pixels.bytes != DicomPixels::kEncapsulated) refuse(slice, "they are not in fragments");
  std::vector<std::byte> stream = joined_fragments(slice);
  if (coding == DicomCoding::rle) {
    check_rle(stream, slice);
  } else if (coding == DicomCoding::jpeg_2000) {
    check_frame(jpeg_2000_frame(stream, slice), slice);
  } else {
    check_frame(JpegMarkers(stream, coding == DicomCoding::jpeg_ls, slice).frame(), slice);
  }
  return stream;
}

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
  const std::size_t bytes = slice.stored_bytes();
  constexpr std::size_t kStrongestCompression = 2000;  // an empty image as JPEG 2000
  if (bytes / kStrongestCompression > stream.size())
    throw BadDataError(slice.file, "truncated: " + std::to_string(stream.size()) +
                                       " bytes cannot hold " + std::to_string(slice.columns) + "×" +
                                       std::to_string(slice.rows) + " pixels");
  const auto image = image_of(slice, stream);
  std::vector<std::byte> values(bytes);
  if (image->GetBufferLength() != bytes ||
      !image->GetBuffer(reinterpret_cast<char*>(values.data())))
    throw BadDataError(slice.file, "its compressed pixels are damaged");
  return values;
}

}  // namespace organbake
