// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_segmentation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "dicom/dicom_codec.h"
#include "dicom/dicom_codestream.h"
#include "dicom/dicom_document.h"
#include "files/byte_stream.h"
#include "grid/affine_grid.h"
#include "labels/mask_labels.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/volume/region.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDeflated = "1.2.840.10008.1.2.1.99";
constexpr const char* kBigEndian = "1.2.840.10008.1.2.2";
constexpr double kSameFramePlane_mm = 0.01;
// A frame this far from a plane of the grid, in gaps, belongs to none.
constexpr double kOffPlane = 0.05;

struct SegmentFrame {
  int segment = 0;  // 0 = a label map, whose values are the segments
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  int slice = 0;
};

struct Segmentation {
  std::string kind;  // BINARY, FRACTIONAL, LABELMAP
  int bits = 1;
  double half = 0.5;  // of a fractional one's largest value
  Volume grid;
  std::vector<SegmentFrame> frames;
  std::vector<std::byte> pixels;
};

bool vector_of(const vtkDICOMValue& value, std::size_t count, double* out) {
  if (value.GetNumberOfValues() != count) return false;
  for (std::size_t i = 0; i < count; ++i) out[i] = value.GetDouble(i);
  return std::all_of(out, out + count, [](double x) { return std::isfinite(x); });
}

// Segments may overlap, so each is a layer; those of a label map do not, and its 0 is the ground
// that some programs list, too.
std::vector<LabelName> segment_names(const DicomDocument& document, bool label_map) {
  std::vector<LabelName> names;
  const vtkDICOMValue& segments = document.data().Get(DC::SegmentSequence);
  for (std::size_t i = 0; i < segments.GetNumberOfValues(); ++i) {
    const vtkDICOMItem& item = segments.GetItem(i);
    const int number = item.Get(DC::SegmentNumber).AsInt();
    std::string name = dicom_text(item.Get(DC::SegmentLabel));
    if (name.empty()) name = "segment " + std::to_string(number);
    if (label_map && number == 0) continue;
    names.push_back({number, name, label_map ? 0 : static_cast<int>(i)});
  }
  return names;
}

// The planes of all frames, at even gaps: those without anything in them have no frame.
void set_planes(Segmentation& seg, const Eigen::Vector3d& normal, const Eigen::Matrix3d& in_plane,
                double told_gap_mm, const fs::path& file) {
  std::vector<double> along;
  for (const SegmentFrame& frame : seg.frames) along.push_back(frame.position_mm.dot(normal));
  std::sort(along.begin(), along.end());
  double gap = HUGE_VAL;
  for (std::size_t i = 1; i < along.size(); ++i) {
    const double step = along[i] - along[i - 1];
    if (step > kSameFramePlane_mm) gap = std::min(gap, step);
  }
  if (!std::isfinite(gap)) gap = told_gap_mm > 0 ? told_gap_mm : 1;
  const double slices = std::round((along.back() - along.front()) / gap) + 1;
  checked_grid_size(Eigen::Vector3d(seg.grid.size[0], seg.grid.size[1], slices), file.string());
  seg.grid.size[2] = static_cast<int>(slices);
  const auto first = std::min_element(
      seg.frames.begin(), seg.frames.end(), [&](const SegmentFrame& a, const SegmentFrame& b) {
        return a.position_mm.dot(normal) < b.position_mm.dot(normal);
      });
  // Over many slices a gap that was rounded adds up: the mean is the true one.
  if (slices > 1) gap = (along.back() - along.front()) / (slices - 1);
  for (SegmentFrame& frame : seg.frames) {
    const double plane = (frame.position_mm.dot(normal) - along.front()) / gap;
    if (std::abs(plane - std::round(plane)) > kOffPlane) {
      throw BadDataError(file, "has frames at uneven gaps (one lies " + to_text(plane, 2) +
                                   " gaps of " + to_text(gap, 2) +
                                   " mm from the first); save the segmentation on its CT's grid");
    }
    frame.slice = static_cast<int>(std::lround(plane));
  }
  Eigen::Matrix3d axes = in_plane;
  axes.col(2) = normal * gap;
  set_grid(seg.grid, axes, first->position_mm, file.string());
}

void read_frames(const DicomDocument& document, Segmentation& seg, const fs::path& file) {
  vtkDICOMMetaData& data = document.data();
  const int count = std::max(1, data.Get(DC::NumberOfFrames).AsInt());
  constexpr std::uintmax_t kLeastFrame = 8;  // bytes of its place, if it had no pixels
  if (static_cast<std::uintmax_t>(count) > fs::file_size(document.readable()) / kLeastFrame)
    throw BadDataError(file, "truncated: it cannot hold " + std::to_string(count) + " frames");
  double orientation[6], spacing[2], position[3];
  if (!vector_of(data.Get(0, 0, DC::ImageOrientationPatient), 6, orientation) ||
      !vector_of(data.Get(0, 0, DC::PixelSpacing), 2, spacing)) {
    throw BadDataError(file, "does not say its orientation or pixel spacing");
  }
  const Eigen::Map<const Eigen::Vector3d> row(orientation), column(orientation + 3);
  for (int frame = 0; frame < count; ++frame) {
    if (!vector_of(data.Get(0, frame, DC::ImagePositionPatient), 3, position)) {
      throw BadDataError(file, "frame " + std::to_string(frame + 1) + " has no position");
    }
    SegmentFrame& read = seg.frames.emplace_back();
    read.position_mm = Eigen::Map<const Eigen::Vector3d>(position);
    if (seg.kind != "LABELMAP") {
      read.segment = data.Get(0, frame, DC::ReferencedSegmentNumber).AsInt();
    }
  }
  Eigen::Matrix3d axes;
  axes << row * spacing[1], column * spacing[0], row.cross(column);
  const vtkDICOMValue& gap = data.Get(0, 0, DC::SpacingBetweenSlices);
  set_planes(seg, row.cross(column).normalized(), axes, gap.IsValid() ? gap.AsDouble() : 0, file);
}

// Frames that were compressed one by one, without loss.
void read_compressed(const DicomDocument& document, const std::string& syntax, DicomCoding coding,
                     Segmentation& seg, const fs::path& file) {
  if (seg.bits == 1) {
    throw BadDataError(file, "is a segmentation of single bits in transfer syntax \"" + syntax +
                                 "\", which has none; save it uncompressed");
  }
  DicomSlice slice;
  slice.file = document.readable();
  slice.columns = seg.grid.size[0];
  slice.rows = seg.grid.size[1];
  slice.pixels.transfer_syntax = syntax;
  slice.pixels.bits_allocated = slice.pixels.bits_stored = seg.bits;
  slice.pixels.frames = static_cast<int>(seg.frames.size());
  slice.pixels.present = true;
  slice.pixels.offset = document.pixel_offset();
  slice.pixels.bytes = DicomPixels::kEncapsulated;
  for (; slice.frame < slice.pixels.frames; ++slice.frame) {
    const std::vector<std::byte> frame = decompress(slice, coding);
    seg.pixels.insert(seg.pixels.end(), frame.begin(), frame.end());
  }
}

void read_pixels(const DicomDocument& document, Segmentation& seg, const fs::path& file) {
  const std::string syntax = document.text(DC::TransferSyntaxUID);
  const DicomCoding coding = syntax == kDeflated ? DicomCoding::native : coding_of(syntax);
  if (coding == DicomCoding::unknown || coding == DicomCoding::lossy_jpeg || syntax == kBigEndian) {
    throw BadDataError(file, "is a segmentation in transfer syntax \"" + syntax +
                                 "\", which is not read; save it uncompressed");
  }
  if (coding != DicomCoding::native) return read_compressed(document, syntax, coding, seg, file);
  const std::uint64_t values = static_cast<std::uint64_t>(seg.grid.size[0]) *
                               static_cast<std::uint64_t>(seg.grid.size[1]) * seg.frames.size();
  const std::uint64_t bytes = (values * static_cast<std::uint64_t>(seg.bits) + 7) / 8;
  if (bytes > document.pixel_bytes()) {
    throw BadDataError(
        file, "truncated: it cannot hold " + std::to_string(seg.frames.size()) + " frames");
  }
  seg.pixels.resize(static_cast<std::size_t>(bytes));
  ByteStream(document.readable(), ByteStream::Coding::raw, document.pixel_offset())
      .read_exactly(seg.pixels);
}

// The stored value number i, counted over all frames: single bits are packed across them.
int stored_value(const Segmentation& seg, std::size_t i) {
  if (seg.bits == 1) return std::to_integer<int>(seg.pixels[i / 8] >> (i % 8) & std::byte{1});
  if (seg.bits == 8) return std::to_integer<int>(seg.pixels[i]);
  return std::to_integer<int>(seg.pixels[2 * i]) | std::to_integer<int>(seg.pixels[2 * i + 1]) << 8;
}

// Frames that are of the segment, or all frames of a label map with all its labels.
Volume one_layer(const Segmentation& seg, int number) {
  const bool label_map = seg.kind == "LABELMAP";
  Volume volume = seg.grid;
  const std::size_t plane = std::size_t(volume.size[0]) * volume.size[1];
  volume.voxels.assign(plane * volume.size[2], 0);
  const bool wide = label_map ? seg.bits == 16 : number > std::numeric_limits<std::int16_t>::max();
  if (wide) make_real(volume);
  for (std::size_t frame = 0; frame < seg.frames.size(); ++frame) {
    if (seg.frames[frame].segment != 0 && seg.frames[frame].segment != number) continue;
    const std::size_t first = plane * seg.frames[frame].slice;
    for (std::size_t i = 0; i < plane; ++i) {
      const int value = stored_value(seg, frame * plane + i);
      if (label_map) {
        set_value(volume, first + i, value);
      } else if (value >= seg.half) {
        set_value(volume, first + i, number);
      }
    }
  }
  return volume;
}

Segmentation read_segmentation(const fs::path& file) {
  const DicomDocument document(file);
  Segmentation seg;
  seg.kind = document.text(DC::SegmentationType);
  if (seg.kind.empty()) seg.kind = "BINARY";
  vtkDICOMMetaData& data = document.data();
  seg.bits = data.Get(DC::BitsAllocated).AsInt();
  if (seg.bits != 1 && seg.bits != 8 && seg.bits != 16) {
    throw BadDataError(
        file, "is a segmentation of " + std::to_string(seg.bits) + " bits; 1, 8 or 16 are needed");
  }
  if (seg.kind == "FRACTIONAL") seg.half = data.Get(DC::MaximumFractionalValue).AsInt() / 2.0;
  seg.grid.size = {data.Get(DC::Columns).AsInt(), data.Get(DC::Rows).AsInt(), 1};
  checked_voxel_count({seg.grid.size[0], seg.grid.size[1], 1}, file.string());
  read_frames(document, seg, file);
  read_pixels(document, seg, file);
  seg.grid.label_names = segment_names(document, seg.kind == "LABELMAP");
  if (seg.grid.label_names.empty()) throw BadDataError(file, "names no segment");
  return seg;
}

}  // namespace

Volume read_dicom_segmentation(const fs::path& file, const VolumeReadOptions& options) {
  const Segmentation seg = read_segmentation(file);
  const std::vector<LabelName>& names = seg.grid.label_names;
  const std::size_t layers = seg.kind == "LABELMAP" ? 1 : names.size();
  Volume mask = read_layers(
      static_cast<std::int64_t>(layers), options, file.string(), names,
      [&](std::int64_t i) { return one_layer(seg, names[static_cast<std::size_t>(i)].label); });
  mask.ends_with_label = !options.region;
  if (!options.region) return mask;
  const IndexBox box = voxels_of_region(mask, *options.region, file.string());
  return cropped(std::move(mask), box);
}

}  // namespace organbake
